"""The programs that are connected, their calls from arrival to end, and what they keep in the services.

One rule decides whether something begins: a call is registered when it arrives, before a thread takes it, a
stop marks every registered call that it ends, and both the beginning and the stop hold the lock of the
`CallTable`. So no stop slips in between a call's check and what it begins, and none overlooks a call that
still waits for a thread.
"""

from __future__ import annotations

import threading
from collections import Counter, UserDict
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any, Final, TypeVar

from naoserver.errors import InvalidCommand
from zenoh_ice import Clock


@dataclass(frozen=True, slots=True)
class QiLimits:
    """How many connections there may be, and how long is waited for programs, in s of the wall."""

    connections: int = 500
    """Most connections, also silent ones."""
    talk: float = 10.0
    """For a program to begin to talk, and to take what is sent to it."""
    end: float = 5.0
    """For all calls to end, and for every client to be dealt with as lost, at the end."""


MOST_RUNNING: Final = 16
"""Maximum long calls of a client that run at the same time; further ones wait."""
MOST_URGENT: Final = 2
"""Maximum long calls of a client that stop something and run at the same time, besides `MOST_RUNNING`."""
MOST_WAITING: Final = 1000
"""Maximum long calls of a client that run or wait; further ones are refused."""
MOST_WAITING_URGENT: Final = MOST_WAITING + 16
"""The same where the further one stops something."""

CHECK_PERIOD: Final = 0.05
"""Robot seconds between two checks of what a call waits for."""


class Activity(Enum):
    """What a call begins, and by which it can be stopped."""

    JOINTS = auto()
    WALK = auto()
    POSTURE = auto()
    BEHAVIOR = auto()
    SPEECH = auto()
    SOUND = auto()


MOTION: Final = frozenset((Activity.JOINTS, Activity.WALK, Activity.POSTURE, Activity.BEHAVIOR))
"""Everything that moves the robot."""

_Operation = TypeVar("_Operation", bound=Callable[..., Any])


def begins(*activities: Activity, urgent: bool = False) -> Callable[[_Operation], _Operation]:
    """Mark an operation by what its calls begin; a call without marks ends only with its client.

    A long operation that is `urgent` stops something: it waits for no other call of any client.
    """

    def mark(operation: _Operation) -> _Operation:
        operation.begins, operation.urgent = frozenset(activities), urgent  # type: ignore[attr-defined]
        return operation

    return mark


class Client:
    """A connected program, with its threads: no other one can take them."""

    def __init__(self, name: str) -> None:
        self.name: Final = name
        """The client in the eyes of the guards. It holds no lease."""
        self.gone = False
        """Whether it is lost: its calls begin nothing any more."""
        self.awaited_calls = 0
        """How many of its calls are `awaited`."""
        self.on_awaited_call: Callable[[], object] = lambda: None
        """Called when there is one more."""
        self.objects: Final[set[tuple[int, int]]] = set()
        """The addresses of what operations gave it, such as subscribers, and it did not let go."""
        self.threads: Final = ThreadPoolExecutor(MOST_RUNNING, thread_name_prefix="qi call")
        self.urgent_threads: Final = ThreadPoolExecutor(MOST_URGENT, thread_name_prefix="qi stop")

    def close(self) -> None:
        """Take no further calls, and let the threads end after the present ones."""
        for threads in (self.threads, self.urgent_threads):
            threads.shutdown(wait=False)


SERVER: Final = Client("NAOqi")
"""Stands for the server itself, where no client called."""


@dataclass(eq=False)
class Call:
    """A call from its arrival on, perhaps before a thread took it.

    An operation whose first parameter is `call` is a long call: it gets its `Call`, and a thread.
    """

    clock: Clock
    client: Client = SERVER
    activities: frozenset[Activity] = frozenset()
    arguments: tuple[object, ...] = ()
    awaited: bool = field(default=False, kw_only=True)
    """Whether it is a long call whose end its program awaits; it does not await that of a task."""
    stopped: threading.Event = field(default_factory=threading.Event, init=False)
    """Set when it is to end: by its caller, by another call that stops it, or with its client."""
    work: Future[None] | None = field(default=None, init=False)
    """Its place in the queue of its client's threads."""
    refusal: str = field(default="", init=False)
    """The error of its caller if it was stopped before it began; empty if that is none."""

    def wait(self, seconds: float) -> bool:
        """Wait some robot seconds; return at once, and True, when the call is stopped."""
        return self.clock.wait(self.stopped, seconds)

    def stop(self) -> None:
        """Make it end; one that still waits for a thread ends at once."""
        self.stopped.set()
        if self.work is not None:
            self.work.cancel()


_current: ContextVar[Call | None] = ContextVar("current call", default=None)


@contextmanager
def running(call: Call) -> Iterator[None]:
    """Run a call in a `with` block: `CallTable.current` is this call there."""
    token = _current.set(call)
    try:
        yield
    finally:
        _current.reset(token)


class CallTable:
    """The calls that have arrived and not ended, and the lock of everything that they begin."""

    def __init__(self, clock: Clock) -> None:
        self.clock: Final = clock
        self._lock = threading.RLock()
        self._fewer = threading.Condition(self._lock)
        self._calls: dict[Client, set[Call]] = {}
        self._own = Call(clock)
        self._closed = False

    @property
    def current(self) -> Call:
        """The call that runs in this thread; one of the server itself where no client called."""
        return _current.get() or self._own

    def add(self, call: Call, most: float = MOST_WAITING) -> None:
        """Register a call at its arrival; that of a lost client is stopped.

        Raises InvalidCommand when `most` calls of its client are registered already, and after the end.
        """
        with self._lock:
            if self._closed:
                raise InvalidCommand("call", "the robot is shutting down")
            own = self._calls.setdefault(call.client, set())
            if len(own) >= most:
                raise InvalidCommand("call", f"{most} calls of this program run or wait already")
            own.add(call)
            call.client.awaited_calls += call.awaited
            if call.client.gone:
                call.stop()
        if call.awaited:
            call.client.on_awaited_call()

    def remove(self, call: Call) -> None:
        """Remove a call at its end."""
        with self._fewer:
            own = self._calls[call.client]
            own.discard(call)
            call.client.awaited_calls -= call.awaited
            if not own:
                del self._calls[call.client]
            self._fewer.notify_all()

    def close(self, seconds: float) -> bool:
        """Stop all calls, and take no more; return whether they have ended within some wall seconds."""
        with self.stopping(lambda _call: True):
            self._closed = True
        with self._fewer:
            return self._fewer.wait_for(lambda: not self._calls, seconds)

    @contextmanager
    def beginning(self, call: Call | None = None) -> Iterator[bool]:
        """Begin something in a `with` block, which gets whether the call may: not if it was stopped.

        Nothing stops it during the block. Without a `call` it is the current one.
        """
        with self._lock:
            call = call or self.current
            yield not (call.stopped.is_set() or call.client.gone)

    @contextmanager
    def stopping(self, chosen: Callable[[Call], bool], refusal: str = "") -> Iterator[None]:
        """Stop all calls that are `chosen`, and in the `with` block what they have begun.

        The callers of those that had begun nothing get an error if there is a `refusal`.
        """
        with self._lock:
            found = [call for own in self._calls.values() for call in own if chosen(call)]
            for call in found:
                call.refusal = refusal
                call.stopped.set()
            yield
        for call in found:
            call.stop()


def begins_any(*activities: Activity) -> Callable[[Call], bool]:
    """Return the choice of the calls that begin any of some activities."""
    chosen = frozenset(activities)
    return lambda call: not chosen.isdisjoint(call.activities)


K = TypeVar("K")
V = TypeVar("V")


class Belongings(UserDict[K, V]):
    """Values that clients keep in a service, each with its client: few of one, and none of a lost one.

    Not thread-safe.
    """

    def __init__(self, calls: CallTable, what: str, most: int) -> None:
        """Keep at most `most` of each client; the error says `what` they are."""
        super().__init__()
        self._calls = calls
        self._what = what
        self._most = most
        self._owners: dict[K, Client] = {}
        self._counts: Counter[Client] = Counter()

    def __setitem__(self, key: K, value: V) -> None:
        """Set a value, which belongs to the current client from now on.

        Raises InvalidCommand when that client has too many values, or is lost.
        """
        client = self._calls.current.client
        if client.gone:
            raise InvalidCommand(self._what, "the program is gone")
        if self._owners.get(key) is not client:
            if self._counts[client] >= self._most:
                message = f"this program has {self._most} {self._what} already: remove some"
                raise InvalidCommand(self._what, message)
            self.pop(key, None)
            self._owners[key] = client
            self._counts[client] += 1
        self.data[key] = value

    def __delitem__(self, key: K) -> None:
        del self.data[key]
        client = self._owners.pop(key)
        self._counts[client] -= 1
        if not self._counts[client]:
            del self._counts[client]

    def change(self, key: K, value: V) -> None:
        """Change a value, if it is there; it stays with its client."""
        if key in self.data:
            self.data[key] = value

    def take(self, client: Client) -> dict[K, V]:
        """Remove and return the values of a client."""
        return {key: self.pop(key) for key in [key for key, one in self._owners.items() if one is client]}
