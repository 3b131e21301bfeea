"""Calls, samples and tokens within one process: for tests, and for servants of the caller's own process."""

from __future__ import annotations

import itertools
import logging
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from functools import partial
from typing import Any, Final

from ._codec import Parted, Pieces
from ._threads import Pool
from ._wire import encode_error, unknown_exception
from .exceptions import ConnectionLostException, MarshalException, SystemException
from .interface import Operation
from .transport import (
    Answer,
    Arrived,
    Caller,
    Closing,
    Inlet,
    NoAnswer,
    Outcome,
    Outlet,
    Receiver,
    Served,
    Target,
)

__all__ = ["InProcessTransport", "Pool"]

_numbers: Final = itertools.count(1)

_logger = logging.getLogger(__name__)


class InProcessTransport:
    """Join the servants and the proxies of one process, without a network.

    With a pool of no threads all happens at once, on the thread that calls or publishes.
    """

    endpoints: Final[Sequence[str]] = ()
    token_delay: Final = 0.0

    def __init__(self, pool: Pool) -> None:
        self.id: Final = f"{next(_numbers):x}"
        self.pool: Final = pool
        self.receivers: Final[dict[Target, Receiver]] = {}
        self._pending: Final[set[Future[Answer]]] = set()
        self._closed = False
        self._lock: Final = threading.RLock()
        self._inlets: Final[dict[str, list[_Inlet]]] = {}
        self._outlets: Final[dict[str, list[_Outlet]]] = {}
        self._tokens: Final[dict[str, None]] = {}
        self._watchers: Final[list[tuple[str, Callable[[str, bool], object]]]] = []
        self._status: Final[dict[str, Callable[[], bytes]]] = {}  # by realm

    def explain_unreachable(self) -> str:
        """Return nothing: it connects to nobody."""
        return ""

    def caller(self, target: Target, operation: Operation[..., Any], *, timeout: float) -> Caller:
        """Return what calls the servant that has the identity when it is called."""
        return _Caller(self, target, operation.name, timeout)

    def call(
        self, receiver: Receiver, name: str, payload: bytes, attachment: bytes, timeout: float
    ) -> Outcome:
        """Call a receiver and wait for the answer; raises NoAnswer at the limit, and after `close`."""
        answer = Future[Answer]()

        def reply(ok: bool, payload: bytes | Pieces) -> None:
            with suppress(InvalidStateError):
                answer.set_result((ok, payload))

        def call() -> None:
            try:
                execute = receiver.admit(name, payload, attachment, reply)
                if execute is not None:
                    execute()
            except BaseException as error:
                _logger.exception("internal error in %s", name)
                reply(False, encode_error(unknown_exception(error)))

        self._pending.add(answer)
        if self._closed:
            self._let_go()
        elif receiver.runs_here:
            call()
        else:
            self.pool.submit(call)
        try:
            with self.pool.blocked():
                ok, result = answer.result(timeout)
        except TimeoutError:
            raise NoAnswer(timed_out=True) from None
        finally:
            self._pending.discard(answer)
        return ok, _arrived(result)

    def serve(self, target: Target, receiver: Receiver) -> Served:
        """Give the calls of a target to a receiver."""
        self.receivers[target] = receiver

        def close() -> None:
            if self.receivers.get(target) is receiver:
                del self.receivers[target]

        return Closing(close)

    def publish(
        self, target: Target, operation: Operation[..., Any], changed: Callable[[], object]
    ) -> Outlet:
        """Return the publishing end of a stream."""
        key = target.key(operation.name)
        inlets = self._inlets.setdefault(key, [])
        outlets = self._outlets.setdefault(key, [])
        outlet = _Outlet(inlets, outlets, changed)
        outlets.append(outlet)
        return outlet

    def subscribe(self, target: Target, operation: Operation[..., Any], queue: int = 1) -> Inlet:
        """Return a listening end of a stream."""
        key = target.key(operation.name)
        inlets = self._inlets.setdefault(key, [])
        outlets = self._outlets.setdefault(key, [])

        def changed() -> None:
            for outlet in tuple(outlets):
                outlet.changed()

        inlet = _Inlet(inlets, queue, changed)
        inlets.append(inlet)
        changed()
        return inlet

    def announce(self, token: str) -> Served:
        """Show a token to those who watch."""
        self._notify(token, came=True)
        return Closing(partial(self._notify, token, came=False))

    def watch(self, pattern: str, changed: Callable[[str, bool], object]) -> Served:
        """Call a function with the tokens that begin as a pattern does, up to its first asterisk."""
        watcher = prefix, _ = pattern.partition("*")[0], changed
        with self._lock:
            self._watchers.append(watcher)
            for token in [token for token in self._tokens if token.startswith(prefix)]:
                changed(token, True)
        return Closing(partial(self._watchers.remove, watcher))

    def watch_links(self, changed: Callable[[str, bool], object]) -> Served:  # noqa: ARG002
        """Do nothing: there are no links."""
        return Closing(lambda: None)

    def serve_status(self, realm: str, status: Callable[[], bytes]) -> Served:
        """Answer those who ask for the status of this process."""
        self._status[realm] = status
        return Closing(partial(self._status.pop, realm, None))

    def ask_status(self, realm: str, process: str, timeout: float, limit: int) -> bytes:  # noqa: ARG002
        """Return the status of this process; raises ConnectionLostException for another one."""
        status = self._status.get(realm)
        if process != self.id or status is None:
            raise ConnectionLostException(f"there is no process {process} of realm {realm}")
        answer = status()
        if len(answer) > limit:
            raise MarshalException(
                f"status of {process}: {len(answer)} bytes where at most {limit} are taken"
            )
        return answer

    def close(self) -> None:
        """End calls that wait, and the streams."""
        self._closed = True
        self._let_go()
        for inlet in [inlet for inlets in list(self._inlets.values()) for inlet in list(inlets)]:
            inlet.close()

    def _let_go(self) -> None:
        """Let those who wait for an answer go."""
        for answer in tuple(self._pending):
            with suppress(InvalidStateError):
                answer.set_exception(NoAnswer(timed_out=False))

    def _notify(self, token: str, *, came: bool) -> None:
        with self._lock:
            if came:
                self._tokens[token] = None
            else:
                self._tokens.pop(token, None)
            for changed in [changed for prefix, changed in self._watchers if token.startswith(prefix)]:
                changed(token, came)


class _Caller:
    def __init__(self, transport: InProcessTransport, target: Target, operation: str, timeout: float) -> None:
        self._transport: Final = transport
        self._target: Final = target
        self._operation: Final = operation
        self._timeout: Final = timeout

    def call(self, payload: bytes, attachment: bytes) -> Outcome:
        receiver = self._transport.receivers.get(self._target)
        if receiver is None:
            raise NoAnswer(timed_out=False)
        return self._transport.call(receiver, self._operation, payload, attachment, self._timeout)

    def begin(
        self, payload: bytes, attachment: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        def call() -> None:
            outcome: Outcome | SystemException
            try:
                outcome = self.call(payload, attachment)
            except SystemException as error:
                outcome = error
            done(outcome)

        self._transport.pool.submit(call)
        return lambda: None

    def send(self, payload: bytes, attachment: bytes) -> None:
        receiver = self._transport.receivers.get(self._target)
        if receiver is not None:
            execute = receiver.admit(self._operation, payload, attachment, _discard)
            if execute is not None:
                self._transport.pool.submit(execute)


class _Outlet:
    """The publishing end of a stream."""

    def __init__(self, inlets: list[_Inlet], outlets: list[_Outlet], changed: Callable[[], object]) -> None:
        self.changed: Final = changed
        self._inlets = inlets
        self._outlets: Final = outlets

    @property
    def listening(self) -> bool:
        return bool(self._inlets)

    def put(self, payload: bytes | Pieces, attachment: bytes) -> None:
        arrived = Arrived(_arrived(payload), attachment)
        for inlet in tuple(self._inlets):
            inlet.put(arrived)

    def close(self) -> None:
        self._inlets = []
        if self in self._outlets:
            self._outlets.remove(self)


class _Inlet:
    """The listening end of a stream."""

    def __init__(self, inlets: list[_Inlet], queue: int, changed: Callable[[], object]) -> None:
        self._inlets: Final = inlets
        self._changed: Final = changed
        self._samples: Final[deque[Arrived]] = deque(maxlen=queue)
        self._callback: Callable[[Any], object] | None = None
        self._turn: Final = threading.RLock()  # whose callback may publish in turn

    def poll(self) -> Arrived | None:
        with self._turn:
            return self._samples.popleft() if self._samples else None

    def deliver(self, callback: Callable[[Any], object], rate: float | None = None) -> None:  # noqa: ARG002
        with self._turn:
            self._callback = callback
            while (sample := self.poll()) is not None:
                callback(sample)

    def put(self, sample: Arrived) -> None:
        with self._turn:
            if self._callback is None:
                self._samples.append(sample)
            else:
                self._callback(sample)

    def open(self, sample: Arrived) -> Arrived:
        return sample

    def close(self, timeout: float = 0.0) -> bool:
        if self in self._inlets:
            self._inlets.remove(self)
            self._changed()
        ended = self._turn.acquire(timeout=timeout)
        if ended:
            self._turn.release()
        return ended


def _discard(ok: bool, answer: bytes | Pieces) -> None:
    """Take an answer that nobody waits for."""


def _arrived(payload: bytes | Pieces) -> bytes | Parted:
    """Return a payload as it arrives, without a copy of its large byte sequences."""
    if isinstance(payload, Pieces):
        return Parted(payload.without_large(), payload.places, payload.large)
    return payload
