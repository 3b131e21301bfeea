"""The server's side of calls: one object for each servant that is served."""

from __future__ import annotations

import logging
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import zenoh

from ..exceptions import ZenohIceError
from ..identity import Target
from ..object import Object
from ..streams.publisher import Channel, Publisher
from ..streams.stream_source import HISTORY_PARAMETER
from ..wire.errors import encode_error, unknown_exception
from .answer_memory import Answer, AnswerLater
from .query_inbox import QueryInbox
from .registration import Arrived, Registration, nobody, reply, take_request
from .skeleton import Skeleton

if TYPE_CHECKING:
    from ..adapter import ObjectAdapter
    from ..communicator import Communicator

__all__ = ["Incoming"]

_logger = logging.getLogger(__name__)


class Incoming(Registration):
    """Serve one servant under one identity and facet: queryables, tokens, publishers, and the way of a call.

    Of a replica others may serve the same: it is called under a key of its own, too.
    """

    def __init__(
        self,
        communicator: Communicator,
        target: Target,
        servant: Object,
        adapter: ObjectAdapter | None = None,
        *,
        replica: bool = False,
    ) -> None:
        skeleton = Skeleton(communicator, servant)
        super().__init__(
            communicator,
            adapter,
            target,
            interface=skeleton.interface,
            dispatcher=communicator.dispatcher,
            width=skeleton.width,
        )
        self.servant: Final = servant
        self.replicated = replica
        self._skeleton: Final = skeleton
        self._owner: Final = target.object
        self._own_prefix: Final = f"{target.prefix}~{communicator.client_id}/" if replica else target.prefix
        self._channels: Final[dict[str, tuple[Publisher[Any], Channel]]] = {}

    @property
    def fingerprints(self) -> dict[str, str]:
        """The fingerprints of the servant's interfaces by type id."""
        return self._skeleton.fingerprints

    def activate(self, session: zenoh.Session) -> None:
        """Take calls from now on; nobody knows of it before `announce`."""
        target, interface = self.target, self._interface
        for operation in interface.all_operations.values():
            if operation.streamed:
                publisher = self.servant.ice_publisher(operation)
                key = target.prefix + operation.name
                channel = Channel(self._communicator, key, publisher, interface.fingerprint)
                self._channels[operation.name] = publisher, channel
                publisher.attach(channel)
        own = self._own_prefix
        for prefix in dict.fromkeys((target.prefix, own)):
            inbox = QueryInbox(
                f"servant {target.object}", partial(self._answer, prefix), width=self._skeleton.width
            )
            self._inboxes.append(inbox)
            inbox.open(session, prefix + "*", complete=True)
        # By its own key alone: one that is sent to all replicas would be executed by all.
        self._oneways.open(
            session, [own + known.name for known in interface.all_operations.values() if known.oneway]
        )

    def withdraw(self) -> None:
        """Take no more calls, then let everybody know."""
        super().withdraw()
        while self._channels:
            _, (publisher, channel) = self._channels.popitem()
            publisher.detach(channel)
            channel.close()

    def _listened(self) -> tuple[str, ...]:
        channels = dict(self._channels)  # it may be withdrawn meanwhile
        return tuple(name for name, (_, channel) in channels.items() if channel.listening)

    def call_here(self, name: str, payload: bytes, attachment: bytes, timeout: float) -> Answer:
        """Execute a call from this process; see `Registration`."""
        return self._call_here(self.target, name, payload, attachment, timeout)

    def _answer(self, prefix: str, query: zenoh.Query, since: float) -> None:
        key = query.key_expr
        name = str(key).removeprefix(prefix)
        if name in self._channels and (history := query.parameters.get(HISTORY_PARAMETER)) is not None:
            _, channel = self._channels[name]
            channel.answer(query, history)
            return
        later = partial(reply, self._communicator, query, key)
        try:
            answer = self._execute_query(query, name, since, later)
        except BaseException as error:
            _logger.exception("internal error at %s", key)
            answer = False, encode_error(unknown_exception(error))
        if answer is not None:
            later(*answer)

    def _execute_query(
        self, query: zenoh.Query, name: str, since: float, later: AnswerLater
    ) -> Answer | None:
        skeleton, upcalls = self._skeleton, self.upcalls
        what = f"{self._owner}.{name}"
        try:
            method = skeleton.method(name, self._owner)
            payload, attachment = take_request(query, method[2], what)
            about, current = upcalls.current(self.target, name, attachment)
        except ZenohIceError as error:
            return upcalls.refuse(error)
        with skeleton.turn:
            return upcalls.execute(
                skeleton, method, about, current, payload, what=what, since=since, later=later
            )

    def _execute_oneway(self, key: str, sample: zenoh.Sample, since: float) -> Answer | None:
        try:
            name = key.removeprefix(self._own_prefix)
            limit = self._skeleton.method(name, self._owner)[2]
            payload, attachment = take_request(sample, limit, f"{self._owner}.{name}")
        except ZenohIceError as error:
            return self.upcalls.refuse(error)
        return self._execute(self.target, name, Arrived(payload, attachment, since, nobody))

    def _execute(self, target: Target, name: str, call: Arrived) -> Answer | None:
        return self._execute_method(self._skeleton, target, name, call)

    def _runs_here(self) -> bool:
        return self._skeleton.runs_here
