"""Calls on servants, from what travelled to what will: checked, decoded, executed, counted, remembered."""

from __future__ import annotations

import inspect
import logging
import threading
import time
from concurrent.futures import Future
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import msgspec
import zenoh

from ..exceptions import (
    BusyException,
    ConnectionLostException,
    MarshalException,
    ObjectNotExistException,
    OperationNotExistException,
    TimeoutException,
    UserException,
    ZenohIceError,
)
from ..identity import Target
from ..object import Current
from ..operation import Operation
from ..wire.attachment import NO_ATTACHMENT, Attachment, decode_attachment
from ..wire.codec import DECODE_ERRORS, misfit
from ..wire.errors import encode_error, unknown_exception
from .answer_memory import Answer, AnswerLater, AnswerMemory, CallKey
from .skeleton import running

if TYPE_CHECKING:
    from ..adapter import ObjectAdapter
    from ..communicator import Communicator
    from .skeleton import Method

__all__ = ["Arrived", "Upcalls", "too_large"]

_MOST_UNANSWERED: Final = 1024  # calls that servants answer later

# What a servant may say itself, as in Ice: a default servant that knows no such object, for instance.
_OF_SERVANTS: Final = (ObjectNotExistException, OperationNotExistException)

_NO_ARGUMENTS: Final = b"\x80"  # an empty map
_NO_CONTEXT: Final = MappingProxyType[str, str]({})

_logger = logging.getLogger(__name__)


class Arrived(msgspec.Struct):
    """A call as it came, but for what is called."""

    payload: bytes
    about: Attachment
    current: Current
    since: float
    """A moment of the monotonic clock before which it had not come."""
    later: AnswerLater
    """Takes the answer of a call that is answered later."""


class Upcalls:
    """Execute the calls of one registration: of a servant, a default servant, or a locator."""

    def __init__(self, communicator: Communicator, adapter: ObjectAdapter | None) -> None:
        self._communicator: Final = communicator
        self._adapter: Final = adapter
        self._pulse: Final = communicator.pulse
        self._memory: Final = AnswerMemory()
        self._lock: Final = threading.Lock()
        self._ended: Final = threading.Condition(self._lock)
        self._unanswered = 0
        self._unanswered_bytes = 0
        self._watched = False  # whether somebody waits for the end of the calls
        self.calls = 0
        """How many calls were executed, those that run included."""
        self.failed = 0
        """How many of them raised what their operation does not declare, or returned what does not fit it."""
        self.refused = 0
        """How many were not executed: malformed, of another interface, too late, or too many."""
        self.running = 0
        """How many are executed now, those that will be answered later included."""

    def receive(
        self,
        target: Target,
        name: str,
        payload: bytes | zenoh.ZBytes | None,
        attachment: bytes | zenoh.ZBytes | None,
        *,
        limit: int,
        since: float,
        later: AnswerLater,
    ) -> Arrived:
        """Return a call that came; raises MarshalException for arguments of more than `limit` bytes."""
        size = 0 if payload is None else len(payload)
        if size > limit:  # before it is so much as copied
            raise too_large(size, limit, f"{target.object}.{name}")
        if payload is None:
            payload = _NO_ARGUMENTS
        elif not isinstance(payload, bytes):
            payload = payload.to_bytes()
        if attachment is None:
            about = NO_ATTACHMENT
        else:
            about = decode_attachment(attachment if isinstance(attachment, bytes) else attachment.to_bytes())
        current = Current(
            target.identity,
            target.facet,
            name,
            about.call_id,
            about.context or _NO_CONTEXT,
            about.timeout,
            self._communicator,
            self._adapter,
        )
        return Arrived(payload, about, current, since, later)

    def execute(self, method: Method, call: Arrived, what: str) -> Answer | None:
        """Execute a call and return the answer; without one yet, None, and `call.later` is given it.

        It is the servant's turn already. `what` names the call in errors. Raises ZenohIceError for a call
        that is refused.
        """
        # One flat way: each step into another function costs a small call more than what is done there.
        operation, about, payload = method.operation, call.about, call.payload
        if method.fingerprints is not None and about.fingerprint not in method.fingerprints:
            raise method.mismatch(about.fingerprint, what)
        if about.timeout > 0:
            given_up = time.monotonic() - about.timeout  # by whoever called before this
            if call.since <= given_up or self._pulse.running_since <= given_up:
                _check_patience(about, what)
        try:
            arguments = msgspec.structs.astuple(method.decode(payload))
        except DECODE_ERRORS as error:
            raise misfit(error, what) from error
        if operation.amd:
            self._check_unanswered(len(payload), what)
        once: CallKey | None = None  # by which it is remembered
        if about.call_id and not operation.idempotent:
            once = about.call_id, what, hash(payload)
            if not self._memory.begin(once):
                return self._memory.answer(once, call.later)
        with self._lock:
            self.calls += 1
            self.running += 1
        servants = running.servants
        servants.append(method.servant)
        try:
            result = method.function(*arguments, call.current)
            if operation.amd and (future := self._future_of(result)) is not None:
                size = len(payload)  # of what Zenoh's query holds until it is answered
                with self._lock:
                    self._unanswered += 1
                    self._unanswered_bytes += size
                future.add_done_callback(
                    partial(self._answer_later, operation, what, once, call.later, size=size)
                )
                return None
        except BaseException as error:  # noqa: BLE001 - logged; not even CancelledError may end the thread
            answer = self._failure(error, operation, what, about.client)
        else:
            try:
                answer = True, operation.result.gather_result(result, what)
            except MarshalException as error:
                answer = self._unfit(result, error, what)
        finally:
            servants.pop()
        with self._lock:
            self.running -= 1
            if self._watched:
                self._ended.notify_all()
        if once is not None:
            self._memory.end(once, *answer)
        return answer

    def refuse(self, error: ZenohIceError) -> Answer:
        """Count a call that is not executed, and return the answer that says why."""
        with self._lock:
            self.refused += 1
        return False, encode_error(error)

    def wait_until_answered(self, timeout: float) -> bool:
        """Wait for at most `timeout` s for the calls that are answered later; return whether they were."""
        with self._ended:
            return self._ended.wait_for(lambda: self._unanswered == 0, timeout)

    def wait_until_idle(self, timeout: float) -> bool:
        """Wait for at most `timeout` s until no call runs; return whether that is so."""
        with self._ended:
            self._watched = True
            return self._ended.wait_for(lambda: self.running == 0, timeout)

    def _check_unanswered(self, size: int, what: str) -> None:
        """Raise BusyException when there is no room for one more call that is answered later."""
        too_large = self._unanswered_bytes + size > self._communicator.settings.max_bulk_size
        if self._unanswered >= _MOST_UNANSWERED or (self._unanswered and too_large):
            raise BusyException(
                f"{what}: {self._unanswered} calls are not answered yet; this one was not executed"
            )

    def _future_of(self, result: object) -> Future[Any] | None:
        if isinstance(result, Future):
            return result
        if inspect.iscoroutine(result):
            return self._communicator.coroutines.run(result)
        return None

    def _answer_later(
        self,
        operation: Operation[..., Any],
        what: str,
        once: CallKey | None,
        later: AnswerLater,
        future: Future[Any],
        *,
        size: int,
    ) -> None:
        """Answer with the outcome of a future, on the thread that gave it that."""
        try:
            if future.cancelled():
                error = ConnectionLostException(f"{what}: its server gave it up without an answer")
                answer: Answer = False, encode_error(error)
            elif (failure := future.exception()) is not None:
                answer = self._failure(failure, operation, what)
            else:
                answer = self._success(future.result(), operation, what)
            if once is not None:
                self._memory.end(once, *answer)
            later(*answer)
        finally:
            with self._ended:
                self.running -= 1
                self._unanswered -= 1
                self._unanswered_bytes -= size
                self._ended.notify_all()

    def _success(self, result: object, operation: Operation[..., Any], what: str) -> Answer:
        try:
            return True, operation.result.gather_result(result, what)
        except MarshalException as error:
            return self._unfit(result, error, what)

    def _unfit(self, result: object, error: MarshalException, what: str) -> Answer:
        refusal = f"result of {error}"
        if inspect.iscoroutine(result):
            result.close()  # or Python warns that nobody waited for it
            refusal = f'result of {what}: only an operation marked ["amd"] may be a coroutine'
        with self._lock:
            self.failed += 1
        _logger.error("%s", refusal)
        return False, encode_error(MarshalException(refusal, error.path))

    def _failure(
        self, error: BaseException, operation: Operation[..., Any], what: str, client: str = ""
    ) -> Answer:
        if isinstance(error, UserException) and isinstance(error, operation.exceptions):
            return False, encode_error(error)
        if isinstance(error, _OF_SERVANTS):
            return False, encode_error(error)
        with self._lock:
            self.failed += 1
        _logger.error("%s failed, called by %r", what, client or "a stranger", exc_info=error)
        return False, encode_error(unknown_exception(error))


def too_large(size: int, limit: int, what: str) -> MarshalException:
    """Return what tells of arguments of more than `limit` bytes."""
    return MarshalException(f"{what}: a request of {size} bytes where at most {limit} are taken")


def _check_patience(about: Attachment, what: str) -> None:
    """Refuse a call whose caller gave up while it waited: what it commands is no longer wanted.

    When it came is not known, only that it may be so long ago. The caller's wall clock, which may be wrong on
    another machine, is believed only where there is such doubt.
    """
    waited = time.time() - about.wall_time
    if waited >= about.timeout:
        raise TimeoutException(f"{what} waited {waited:.3g} s for its turn and was not executed")
