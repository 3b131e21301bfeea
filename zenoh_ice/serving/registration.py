"""What all that is served has in common: calls within the process, tokens, and how it ends."""

from __future__ import annotations

import logging
import math
import time
from abc import ABC, abstractmethod
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Final

import zenoh

from ..dispatch import Lane
from ..exceptions import ObjectNotExistException, TimeoutException, ZenohIceError
from ..identity import Target
from ..network.process_status import ServantStatus
from ..network.servant_tokens import servant_token
from ..wire.attachment import decode_attachment
from ..wire.errors import ERROR_ENCODING, encode_error, unknown_exception
from ..wire.pieces import Pieces
from .answer_memory import Answer, AnswerLater
from .oneway_inbox import OnewayInbox
from .query_inbox import MAX_WAITING, QueryInbox
from .upcalls import Arrived, Upcalls, too_large

if TYPE_CHECKING:
    from ..adapter import ObjectAdapter
    from ..communicator import Communicator
    from ..dispatch import Dispatcher
    from ..operation import Interface
    from .skeleton import Skeleton

__all__ = ["Registration", "nobody", "reply"]

_logger = logging.getLogger(__name__)


class Registration(ABC):
    """Serve something under one target, until it is withdrawn.

    `target` is a servant's, or stands for all of a category that have no servant of their own.
    """

    def __init__(
        self,
        communicator: Communicator,
        adapter: ObjectAdapter | None,
        target: Target,
        *,
        interface: Interface,
        dispatcher: Dispatcher,
        width: int,
    ) -> None:
        self.target: Final = target
        self.replicated = False
        """Whether others may serve the target beside it."""
        self.upcalls: Final = Upcalls(communicator, adapter)
        self._communicator: Final = communicator
        self._interface: Final = interface
        self._dispatcher: Final = dispatcher
        self._lane: Final = Lane(dispatcher, target.object, width=width, depth=MAX_WAITING)
        self._oneways: Final = OnewayInbox(
            target.object,
            dispatcher,
            self._execute_oneway,
            self.upcalls.refuse,
            width=width,
            most_bytes=communicator.settings.max_bulk_size,
        )
        self._inboxes: Final[list[QueryInbox]] = []
        self._tokens: Final[list[zenoh.LivelinessToken]] = []

    @abstractmethod
    def _runs_here(self) -> bool:
        """Return whether the current thread runs a call of it: it must not wait for its own turn."""

    @abstractmethod
    def _limit_of(self, target: Target, name: str) -> int:
        """Return how many bytes the arguments of an operation may have.

        Raises OperationNotExistException.
        """

    @abstractmethod
    def _execute(self, target: Target, name: str, call: Arrived) -> Answer | None:
        """Execute a call on a thread of a pool, or of a call that made it; see `Upcalls.execute`."""

    @abstractmethod
    def _execute_oneway(self, key: str, sample: zenoh.Sample, since: float) -> Answer | None:
        """Execute a oneway call on a thread of a pool."""

    def _take(
        self,
        target: Target,
        name: str,
        payload: bytes | zenoh.ZBytes | None,
        attachment: bytes | zenoh.ZBytes | None,
        *,
        since: float,
        later: AnswerLater,
    ) -> Answer | None:
        """Execute a call on a thread of a pool, or of a call that made it."""
        upcalls = self.upcalls
        try:
            limit = self._limit_of(target, name)
            call = upcalls.receive(target, name, payload, attachment, limit=limit, since=since, later=later)
            return self._execute(target, name, call)
        except ZenohIceError as error:
            return upcalls.refuse(error)

    def _execute_method(self, skeleton: Skeleton, target: Target, name: str, call: Arrived) -> Answer | None:
        """Execute a call of a servant that is known, as `_execute` does."""
        owner = target.object
        method = skeleton.method(name, owner)
        what = f"{owner}.{name}"
        if len(call.payload) > method.limit:
            raise too_large(len(call.payload), method.limit, what)
        with skeleton.turn_in_pool(self._dispatcher):
            return self.upcalls.execute(method, call, what)

    @property
    @abstractmethod
    def fingerprints(self) -> dict[str, str]:
        """The fingerprints of the interfaces by type id."""

    @abstractmethod
    def activate(self, session: zenoh.Session) -> None:
        """Take calls from now on; nobody knows of it before `announce`."""

    def announce(self, session: zenoh.Session) -> None:
        """Let everybody know."""
        since = time.time()
        # Its own last: who waits for the servant's own interface finds the others, too.
        for known in reversed(self._interface.lineage):
            key = servant_token(
                self.target,
                known.type_id,
                known.fingerprint,
                self._communicator.client_id,
                since,
                replicated=self.replicated,
            )
            self._tokens.append(session.liveliness().declare_token(key))

    def status(self) -> ServantStatus:
        """Return what it does, and did since it is served."""
        upcalls = self.upcalls
        return ServantStatus(
            type_id=self._interface.type_id,
            calls=upcalls.calls,
            failed=upcalls.failed,
            refused=upcalls.refused,
            running=upcalls.running,
            busy_for=max((inbox.busy_for() for inbox in self._inboxes), default=0.0),
            crowded_ago=min((inbox.crowded_ago() for inbox in self._inboxes), default=math.inf),
            listened=self._listened(),
        )

    def _listened(self) -> tuple[str, ...] | None:
        """Return the streams to which somebody listens."""
        return None

    def withdraw(self) -> None:
        """Take no more calls, then let everybody know."""
        # In this order: who hears that one of several is gone, and calls again, must not reach the same.
        for inbox in self._inboxes:
            inbox.close()
        self._oneways.close()
        while self._tokens:
            self._tokens.pop().undeclare()

    def drain(self, timeout: float) -> bool:
        """Wait for at most `timeout` s for the calls that run, except one of the current thread.

        Return whether they ended, those that are answered later included. What waits its turn longer than
        that is not executed.
        """
        deadline = time.monotonic() + timeout

        def left() -> float:
            return max(0.0, deadline - time.monotonic())

        expected = 1 if self._runs_here() else 0
        ended = self._lane.close(timeout, expected=expected)
        ended = self._oneways.drain(left(), expected=expected) and ended
        for inbox in self._inboxes:
            ended = inbox.join(deadline) and ended
        ended = self.upcalls.wait_until_answered(left()) and ended
        if not ended:
            _logger.error("a call of %s still runs", self.target)
            self._drop_waiting()
        return ended

    def _drop_waiting(self) -> None:
        """Execute nothing any more that waits its turn."""
        self._lane.drop()
        self._oneways.drop()

    def wait_until_idle(self, timeout: float) -> bool:
        """Wait for at most `timeout` s, after `drain`, for what still runs; return whether it ended."""
        return self._lane.close(timeout) and self.upcalls.wait_until_idle(timeout)

    def _call_here(
        self, target: Target, name: str, payload: bytes, attachment: bytes, timeout: float
    ) -> Answer:
        """Execute a call from this process; return whether it succeeded, and its result or error.

        Both are as they would travel.

        Raises TimeoutException, BusyException, ObjectNotExistException.
        """
        future: Future[Answer] = Future()
        since = time.monotonic()

        def later(ok: bool, answer: bytes | Pieces) -> None:
            with suppress(InvalidStateError):
                future.set_result((ok, answer))

        def call() -> None:
            try:
                answer = self._take(target, name, payload, attachment, since=since, later=later)
            except BaseException as error:
                _logger.exception("internal error in %s.%s", target.object, name)
                answer = False, encode_error(unknown_exception(error))
            if answer is not None:
                later(*answer)

        if self._runs_here():  # the servant calls itself: it must not wait for its own turn
            call()
        else:
            self._lane.submit(call, partial(self._tell_withdrawn, later))
        with self._communicator.dispatcher.blocked():
            try:
                return future.result(timeout)
            except TimeoutError:
                raise TimeoutException(
                    f"{target.object}.{name} did not answer within {timeout:g} s"
                ) from None

    def _tell_withdrawn(self, later: AnswerLater) -> None:
        """Answer a call that waited for too long when its servant was withdrawn."""
        error = ObjectNotExistException(f"{self.target.object} is no longer served")
        later(*self.upcalls.refuse(error))


def nobody(ok: bool, answer: bytes | Pieces) -> None:
    """Take the answer of a oneway call."""


def reply(
    communicator: Communicator, query: zenoh.Query, key: zenoh.KeyExpr, ok: bool, answer: bytes | Pieces
) -> None:
    """Answer a query, and let it go: its client would hang until the timeout."""
    try:
        try:  # not `with query`: the sooner it is dropped, the more often both travel in one message
            if ok:
                query.reply(
                    key, answer if isinstance(answer, bytes) else _placed(communicator, query, answer)
                )
            else:
                query.reply_err(bytes(answer), encoding=ERROR_ENCODING)
        finally:
            query.drop()
    except zenoh.ZError as error:  # the session was closed meanwhile
        _logger.debug("answer at %s dropped: %s", key, error)


def _placed(communicator: Communicator, query: zenoh.Query, answer: Pieces) -> bytes:
    """Return a large answer as it is best sent: through shared memory, if its caller can read that."""
    attachment = query.attachment
    client = "" if attachment is None else decode_attachment(attachment.to_bytes()).client
    if communicator.neighbors.includes(client):
        reference = communicator.shared_memory.lender.place(answer)
        if reference is not None:
            return reference
    return bytes(answer)
