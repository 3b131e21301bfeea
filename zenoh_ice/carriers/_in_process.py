"""Calls, samples and tokens within one process."""

from __future__ import annotations

import threading
from collections import defaultdict, deque
from collections.abc import Callable
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, Final

import msgspec

from zenoh_ice.data.codec import Buffer, Parted, Pieces
from zenoh_ice.data.exceptions import ConnectionLostException, SystemException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import (
    Answer,
    Arrived,
    Inlet,
    NoAnswer,
    Outcome,
    Outlet,
    Receiver,
    Receivers,
    Registration,
    outcome_of,
    refusal,
)

_MOST_TOKENS: Final = 1 << 15  # remembered ones; no robot has as many: more means a flood


class InProcess:
    """The servants, streams and tokens of one process, whose end has an id."""

    def __init__(self, pool: Pool, id: str) -> None:
        self.id = id
        self.pool: Final = pool
        self.receivers: Final = Receivers()
        self.awaited: Final[set[SimpleQueue[Answer | None]]] = set()
        """Where calls wait for their answers: None, once the transport is closed."""
        self._lock: Final = threading.RLock()
        self._streams: Final = defaultdict[str, list[_Inlet]](list)  # listeners by key
        self._tokens: Final[dict[str, None]] = {}
        self._watchers: Final[list[tuple[str, Callable[[str, bool], object]]]] = []
        self._status: Final[dict[tuple[str, str], Callable[[], bytes]]] = {}  # by realm and process

    def serve(self, target: Target, receiver: Receiver) -> Registration:
        prefix = target.prefix
        self.receivers[prefix] = receiver

        def close() -> None:
            if self.receivers.get(prefix) is receiver:
                del self.receivers[prefix]

        return Registration(close)

    def publish(self, target: Target, operation: Operation[..., Any]) -> Outlet:
        return _Outlet(self._streams[target.key(operation.name)])

    def subscribe(self, target: Target, operation: Operation[..., Any], queue: int = 1) -> Inlet:
        return _Inlet(self._streams[target.key(operation.name)], queue)

    def announce(self, token: str) -> Registration:
        self.notify(token, True)
        return Registration(partial(self.notify, token, False))

    def watch(self, pattern: str, changed: Callable[[str, bool], object]) -> Registration:
        # Patterns are distinguished by the text before their first asterisk.
        watcher = prefix, _ = pattern.partition("*")[0], changed
        with self._lock:
            self._watchers.append(watcher)
            for token in [token for token in self._tokens if token.startswith(prefix)]:
                changed(token, True)

        def close() -> None:
            with self._lock:  # while tokens are reported, none may be passed over
                self._watchers.remove(watcher)

        return Registration(close)

    def notify(self, token: str, came: bool) -> None:
        """Report a token that appeared or disappeared to the watchers; one that is known appears once."""
        with self._lock:
            if came and token in self._tokens:
                return
            if not came:
                self._tokens.pop(token, None)
            elif len(self._tokens) < _MOST_TOKENS:
                self._tokens[token] = None
            for changed in [changed for prefix, changed in self._watchers if token.startswith(prefix)]:
                changed(token, came)

    def watch_links(self, changed: Callable[[str, bool], object]) -> Registration:  # noqa: ARG002
        return Registration(lambda: None)  # there are no links

    def serve_status(self, realm: str, status: Callable[[], bytes]) -> Registration:
        self._status[realm, self.id] = status
        return Registration(partial(self._status.pop, (realm, self.id), None))

    def ask_status(self, realm: str, process: str, timeout: float) -> Buffer:  # noqa: ARG002
        if (status := self._status.get((realm, process))) is None:
            raise ConnectionLostException(f"there is no process {process} of realm {realm}")
        return status()

    def take(self, answers: SimpleQueue[Answer | None], timeout: float) -> Answer | None:
        """Wait for the answer of a call; raises Empty after `timeout` s."""
        with self.pool.blocked():
            return answers.get(timeout=timeout)

    def close(self) -> None:
        self.receivers.clear()  # first: a call registers its queue, then looks up its receiver
        for outcomes in tuple(self.awaited):
            outcomes.put(None)
        for inlet in [inlet for inlets in list(self._streams.values()) for inlet in inlets]:
            inlet.close()


class InProcessCalls(msgspec.Struct, frozen=True, eq=False):
    """Carries the calls of one operation to a receiver of this process."""

    transport: InProcess
    key: str
    timeout: float

    def call(self, payload: bytes, attachment: bytes) -> Outcome:
        transport = self.transport
        prefix, _, name = self.key.rpartition("/")
        answers: SimpleQueue[Answer | None] = SimpleQueue()

        def reply(ok: bool, answer: bytes | Pieces) -> None:
            answers.put((ok, answer))

        transport.awaited.add(answers)
        try:
            if (receiver := transport.receivers.get(prefix)) is None:
                raise NoAnswer(timed_out=False)
            try:
                job = receiver.admit(name, payload, attachment or None, reply)
            except BaseException as failure:  # noqa: BLE001 - it is logged, and answered
                job = refusal(failure, self.key, reply)
            if job is not None:
                kind, run = job
                if receiver.runs_here:
                    run()
                else:
                    transport.pool.submit(run, kind)
            answer = transport.take(answers, self.timeout)
        except Empty:
            raise NoAnswer(timed_out=True) from None
        finally:
            transport.awaited.discard(answers)
        if answer is None:
            raise NoAnswer(timed_out=False)
        ok, result = answer
        return ok, _arrived(result)

    def begin(
        self, payload: bytes, attachment: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        self.transport.pool.submit(lambda: done(outcome_of(partial(self.call, payload, attachment))))
        return lambda: None


class _Outlet:
    def __init__(self, inlets: list[_Inlet]) -> None:
        self._inlets = inlets

    @property
    def listening(self) -> bool:
        return bool(self._inlets)

    def put(self, payload: bytes | Pieces, attachment: bytes) -> None:
        arrived = Arrived(_arrived(payload), attachment)
        for inlet in tuple(self._inlets):
            inlet.put(arrived)

    def close(self) -> None:
        self._inlets = []


class _Inlet:
    def __init__(self, inlets: list[_Inlet], queue: int) -> None:
        self._inlets: Final = inlets
        self._samples: Final[deque[Arrived]] = deque(maxlen=queue)
        self._callback: Callable[[Any], object] | None = None
        self._waiting: threading.Condition | None = None
        self._delivering: Final = threading.RLock()  # a callback may publish, too
        inlets.append(self)

    def poll(self) -> Arrived | None:
        with self._delivering:
            return self._samples.popleft() if self._samples else None

    def wait(self, changed: threading.Condition, holds: Callable[[], bool], timeout: float) -> bool:
        self._waiting = changed
        return changed.wait_for(holds, timeout)

    def deliver(self, callback: Callable[[Any], object], rate: float | None = None) -> None:  # noqa: ARG002
        with self._delivering:
            self._callback = callback
            while (sample := self.poll()) is not None:
                callback(sample)

    def put(self, sample: Arrived) -> None:
        with self._delivering:
            (self._callback or self._samples.append)(sample)
        if (changed := self._waiting) is not None:  # without our lock, which a poll takes
            with changed:
                changed.notify_all()

    def open(self, sample: Arrived) -> Arrived:
        return sample

    def close(self, timeout: float = 0.0) -> bool:
        if self in self._inlets:
            self._inlets.remove(self)
        ended = self._delivering.acquire(timeout=timeout)
        if ended:
            self._delivering.release()
        return ended


def _arrived(payload: bytes | Pieces) -> bytes | Parted:
    """Return a payload as it arrives, without a copy of its large byte sequences."""
    if isinstance(payload, Pieces):
        return Parted(payload.without_large(), payload.places, payload.large)
    return payload
