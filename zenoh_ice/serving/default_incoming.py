"""The server's side of calls of identities without a servant of their own: default servants."""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import zenoh

from ..dispatch import Dispatcher
from ..exceptions import (
    BusyException,
    ObjectNotExistException,
)
from ..identity import ANY_NAME, NAME, Identity, Target
from ..object import Object
from ..operation import Interface
from ..wire.errors import encode_error, unknown_exception
from .answer_memory import Answer, AnswerLater
from .query_inbox import QueryInbox
from .registration import Registration, nobody, reply
from .skeleton import Skeleton
from .upcalls import Arrived

if TYPE_CHECKING:
    from ..adapter import ObjectAdapter
    from ..communicator import Communicator

__all__ = ["BoundIncoming", "DefaultIncoming", "DefaultServantIncoming", "default_target"]

_DRAIN_LIMIT: Final = 1.0  # s

_KEY: Final = re.compile(rf"({NAME})/(?:({NAME})/)?({NAME})(?:/\+({NAME}))?/({NAME})")

_logger = logging.getLogger(__name__)


def default_target(realm: str, category: str) -> Target:
    """Return what stands for all names of a category, of the empty one for all names."""
    return Target(realm, str(Identity(ANY_NAME, category)))


class DefaultIncoming(Registration):
    """Serve the identities of a category that have no servant of their own.

    Of the empty category those of all categories that have no default servant either.
    """

    def __init__(
        self,
        communicator: Communicator,
        category: str,
        interface: Interface,
        adapter: ObjectAdapter | None,
        width: int,
    ) -> None:
        target = default_target(communicator.realm, category)
        # Its own threads: those of the pool are for what does not take long.
        self._pool: Final = Dispatcher(width, f"default servant {target.identity}")
        super().__init__(
            communicator, adapter, target, interface=interface, dispatcher=self._pool, width=width
        )
        self.category: Final = category
        self.served = False
        """Whether it was activated."""
        self._fingerprints: Final = {known.type_id: known.fingerprint for known in interface.lineage}

    @property
    def fingerprints(self) -> dict[str, str]:
        """The fingerprints of the interfaces by type id."""
        return self._fingerprints

    def activate(self, session: zenoh.Session) -> None:
        """Take calls from now on; nobody knows of it before `announce`."""
        self.served = True
        realm = self.target.realm
        scope = f"{realm}/{self.category}" if self.category else realm
        # Not complete: a servant of the identity's own gets the call alone, if it is in another process. In
        # this one both get it, so the thread of the inbox sorts the calls and lets others execute them.
        inbox = QueryInbox(f"default servant {self.target.identity}", self._sort)
        self._inboxes.append(inbox)
        # Not `**` alone: access control grants whole identities.
        inbox.open(session, f"{scope}/*/**", complete=False)
        names = ["*", "*/*"] if self.category else ["*", "*/*", "*/*/*"]
        self._oneways.open(
            session,
            [
                f"{scope}/{name}/{operation.name}"
                for name in names
                for operation in self._interface.all_operations.values()
                if operation.oneway
            ],
        )

    def drain(self, timeout: float) -> bool:
        """Wait for the calls that run, as every registration does, and end the threads."""
        ended = super().drain(timeout)
        self._drop_waiting()  # also of a servant that removes itself: nobody is left who would execute it
        self._pool.close(0.0 if not ended else _DRAIN_LIMIT)
        return ended

    def serves(self, target: Target) -> bool:
        """Return whether a target is one of the category that has no servant of its own."""
        communicator = self._communicator
        category = target.identity.rpartition("/")[0]
        if target.realm != communicator.realm or self.category not in ("", category):
            return False
        others = [target]
        if category != self.category:
            others.append(default_target(target.realm, category))
        return not any(
            other in communicator.local_servants or communicator.presence.interfaces(other)
            for other in others
        )

    def call_here(
        self, target: Target, name: str, payload: bytes, attachment: bytes, timeout: float
    ) -> Answer:
        """Execute a call from this process; see `Registration`."""
        return self._call_here(target, name, payload, attachment, timeout)

    def _sort(self, query: zenoh.Query, since: float) -> None:
        key = query.key_expr
        found = self._parse(str(key))
        if found is None:
            query.drop()
            return
        later = partial(reply, self._communicator, query, key)
        try:
            self._lane.submit(
                partial(self._answer, query, *found, since, later), partial(self._tell_withdrawn, later)
            )
        except (BusyException, ObjectNotExistException) as error:
            later(*self.upcalls.refuse(error))

    def _answer(
        self, query: zenoh.Query, target: Target, name: str, since: float, later: AnswerLater
    ) -> None:
        try:
            answer = self._take(target, name, query.payload, query.attachment, since=since, later=later)
        except BaseException as error:
            _logger.exception("internal error in %s.%s", target.object, name)
            answer = False, encode_error(unknown_exception(error))
        if answer is not None:
            later(*answer)

    def _execute_oneway(self, key: str, sample: zenoh.Sample, since: float) -> Answer | None:
        found = self._parse(key)
        if found is None:
            return None
        return self._take(*found, sample.payload, sample.attachment, since=since, later=nobody)

    def _parse(self, key: str) -> tuple[Target, str] | None:
        """Return who is called for what, or None when somebody else serves that."""
        match = _KEY.fullmatch(key)
        if match is None:
            return None
        realm, category, name, facet, operation = match.groups()
        target = Target(realm, str(Identity(name, category or "")), facet or "")
        return (target, operation) if self.serves(target) else None


class DefaultServantIncoming(DefaultIncoming):
    """Serve a category by one servant."""

    def __init__(
        self, communicator: Communicator, category: str, servant: Object, adapter: ObjectAdapter | None
    ) -> None:
        self.servant: Final = servant
        self._skeleton: Final = Skeleton(communicator, servant)
        super().__init__(communicator, category, servant.ice_interface, adapter, self._skeleton.width)

    def _execute(self, target: Target, name: str, call: Arrived) -> Answer | None:
        return self._execute_method(self._skeleton, target, name, call)

    def _limit_of(self, target: Target, name: str) -> int:
        return self._skeleton.method(name, target.object).limit

    def _runs_here(self) -> bool:
        return self._skeleton.runs_here


@dataclass(frozen=True, slots=True)
class BoundIncoming:
    """A default servant or a locator, for calls from this process of one of the identities that it serves."""

    incoming: DefaultIncoming
    target: Target

    @property
    def fingerprints(self) -> dict[str, str]:
        """The fingerprints of the interfaces by type id."""
        return self.incoming.fingerprints

    def call_here(self, name: str, payload: bytes, attachment: bytes, timeout: float) -> Answer:
        """Execute a call from this process; see `Registration`."""
        return self.incoming.call_here(self.target, name, payload, attachment, timeout)
