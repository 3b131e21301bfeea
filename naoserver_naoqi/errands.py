"""Calls whose answers nobody waits for: single ones, questions asked again and again, commands in order."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any, Final, Generic, TypeVar

from naoserver.errors import HardwareFailure
from naoserver_naoqi.connection import Connection, Reporter, join
from naoserver_naoqi.link import Link, Reply

MOST: Final = 200
"""Calls that may go on at the same time; a robot that answers none gets no more."""
_AFTER_FAILURE: Final = 2.0
_PATIENCE: Final = 1.0
"""Seconds that the robot gets to obey, before the next command is sent all the same."""
_END: Final = 2.0

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


class Errands:
    """Begin calls, and report those that failed."""

    def __init__(self, connection: Connection, reporter: Reporter) -> None:
        self._connection = connection
        self._reporter = reporter
        self._lock = threading.Lock()
        self._replies: list[tuple[str, Reply]] = []

    def run(self, operation: str, *arguments: object) -> None:
        """Begin a call. Raises LinkLost while the robot is lost."""
        link = self._connection.require()
        with self._lock:
            if len(self._replies) >= MOST:
                raise HardwareFailure(f"{operation}: the robot has not answered {MOST} calls before it")
            self._replies.append((operation, link.begin(operation, *arguments)))

    def tick(self, _link: Link) -> None:
        """Look at the answers that have come."""
        with self._lock:
            done = [each for each in self._replies if each[1].done]
            self._replies = [each for each in self._replies if each not in done]
        for operation, reply in done:
            with self._reporter.failures_of(operation):
                reply.result(0.0)

    def forget(self) -> None:
        """Expect no answers any more: the robot is lost."""
        with self._lock:
            self._replies = []


class Question:
    """Ask something again when its period has passed, without waiting for the answer.

    `take` gets each answer, and the time in s at which it was asked for; it may raise HardwareFailure. A
    question that failed is told, and asked again later.
    """

    def __init__(
        self,
        reporter: Reporter,
        now: Callable[[], float],
        period: Callable[[], float],
        take: Callable[[Any, float], None],
        operation: str,
        *arguments: object,
    ) -> None:
        self._reporter = reporter
        self._now = now
        self._period = period
        self._take = take
        self._operation = operation
        self._arguments = arguments
        self._asked = float("-inf")
        self._due = float("-inf")
        self._reply: Reply | None = None

    def open(self, _link: Link) -> None:
        """Begin anew with a new link."""
        self._reply, self._due = None, float("-inf")

    def tick(self, link: Link) -> None:
        """Take the answer that has come, and ask again when it is time."""
        if self._reply is not None and self._reply.done:
            reply, self._reply = self._reply, None
            self._due = self._now() + _AFTER_FAILURE
            with self._reporter.failures_of(self._operation):
                self._take(reply.result(0.0), self._asked)
                self._due = self._asked + self._period()
        if self._reply is None and self._now() >= self._due:
            self._asked = self._now()
            self._reply = link.begin(self._operation, *self._arguments)


class Lane(Generic[K, V]):
    """Commands of one kind, of which the newest for each key counts.

    NAOqi may run two calls in either order: so the next is sent when the one before has been answered. The
    first goes out from the caller's own thread. What comes meanwhile waits, and of two commands for the same
    key the newer one is sent: however slow the robot is, nothing piles up. `send` begins the calls.
    """

    def __init__(
        self,
        name: str,
        connection: Connection,
        reporter: Reporter,
        send: Callable[[Link, Mapping[K, V]], Sequence[Reply]],
    ) -> None:
        self._name = name
        self._connection = connection
        self._reporter = reporter
        self._send = send
        self._changed = threading.Condition()
        self._waiting: dict[K, V] = {}
        self._replies: Sequence[Reply] = ()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name=f"NAOqi {name}", daemon=True)

    @property
    def idle(self) -> bool:
        """Whether every command has been answered."""
        with self._changed:
            return not self._replies and not self._waiting

    def post(self, commands: Mapping[K, V]) -> None:
        """Send commands, now or as soon as those before have been answered; drop them while it is lost."""
        with self._changed:
            link = self._connection.link
            if self._closing or link is None:
                return
            self._waiting.update(commands)
            if not self._replies:
                self._begin(link)
                self._changed.notify_all()
                if self._thread.ident is None:
                    self._thread.start()

    def forget(self) -> None:
        """Drop what was not sent yet."""
        with self._changed:
            self._waiting.clear()

    def close(self) -> None:
        """Send what waits, and end the thread."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        join(self._thread, _END)

    def _begin(self, link: Link) -> None:
        commands, self._waiting = self._waiting, {}
        try:
            self._replies = self._send(link, commands)
        except HardwareFailure as error:
            self._reporter.report_once(self._name, str(error))

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._replies or self._closing)
                replies = self._replies
                if not replies:
                    return
            for reply in replies:
                with self._reporter.failures_of(self._name):
                    reply.result(_PATIENCE)
            with self._changed:
                self._replies = ()
                link = self._connection.link
                if link is None:
                    self._waiting.clear()
                elif self._waiting:
                    self._begin(link)
                self._changed.notify_all()
                if self._thread.ident is None:
                    self._thread.start()
