"""The server's side of calls: one object for each servant that is served."""

from __future__ import annotations

import logging
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import zenoh

from ..exceptions import ZenohIceError
from ..identity import Target
from ..object import Object
from ..streams.publisher import Channel, Publisher
from ..streams.stream_source import HISTORY_PARAMETER
from ..wire.errors import encode_error, unknown_exception
from .answer_memory import Answer
from .query_inbox import QueryInbox
from .registration import Registration, nobody, reply
from .skeleton import Method, Skeleton
from .upcalls import Arrived

if TYPE_CHECKING:
    from ..adapter import ObjectAdapter
    from ..communicator import Communicator

__all__ = ["Incoming"]

_logger = logging.getLogger(__name__)


class _Known(NamedTuple):
    """What a key stands for."""

    method: Method
    what: str
    """How it is called in errors."""
    key: zenoh.KeyExpr
    """The key, declared: Zenoh finds the way of calls and replies quicker where it knows their key."""


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
        self._known: Final[dict[str, _Known]] = {}
        """By key what was called."""
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
            inbox = QueryInbox(f"servant {target.object}", self._answer, width=self._skeleton.width)
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
        while self._known:
            self._communicator.session.undeclare(self._known.popitem()[1].key)

    def _listened(self) -> tuple[str, ...]:
        channels = dict(self._channels)  # it may be withdrawn meanwhile
        return tuple(name for name, (_, channel) in channels.items() if channel.listening)

    def call_here(self, name: str, payload: bytes, attachment: bytes, timeout: float) -> Answer:
        """Execute a call from this process; see `Registration`."""
        return self._call_here(self.target, name, payload, attachment, timeout)

    def _answer(self, query: zenoh.Query, since: float) -> None:
        key = query.key_expr
        text = str(key)
        later = partial(reply, self._communicator, query, key)
        skeleton, upcalls = self._skeleton, self.upcalls
        try:
            method, what, _ = self._known.get(text) or self._know(text)
            name = method.operation.name
            if name in self._channels and (history := query.parameters.get(HISTORY_PARAMETER)) is not None:
                _, channel = self._channels[name]
                channel.answer(query, history)
                return
            call = upcalls.receive(
                self.target,
                name,
                query.payload,
                query.attachment,
                limit=method.limit,
                since=since,
                later=later,
            )
            with skeleton.turn:
                answer = upcalls.execute(method, call, what)
        except ZenohIceError as error:
            answer = upcalls.refuse(error)
        except BaseException as error:
            _logger.exception("internal error at %s", key)
            answer = False, encode_error(unknown_exception(error))
        if answer is not None:
            later(*answer)

    def _know(self, key: str) -> _Known:
        """Return what a key stands for, and remember it; raises OperationNotExistException."""
        name = key.removeprefix(self._own_prefix).removeprefix(self.target.prefix)
        method = self._skeleton.method(name, self._owner)
        known = _Known(method, f"{self._owner}.{name}", self._communicator.session.declare_keyexpr(key))
        return self._known.setdefault(key, known)

    def _execute_oneway(self, key: str, sample: zenoh.Sample, since: float) -> Answer | None:
        name = key.removeprefix(self._own_prefix)
        return self._take(self.target, name, sample.payload, sample.attachment, since=since, later=nobody)

    def _execute(self, target: Target, name: str, call: Arrived) -> Answer | None:
        return self._execute_method(self._skeleton, target, name, call)

    def _limit_of(self, target: Target, name: str) -> int:
        return self._skeleton.method(name, target.object).limit

    def _runs_here(self) -> bool:
        return self._skeleton.runs_here
