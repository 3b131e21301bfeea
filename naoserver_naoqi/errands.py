"""Calls whose answers nobody waits for, and questions that are asked again and again."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Final

from naoserver.errors import HardwareFailure
from naoserver_naoqi.connection import Connection
from naoserver_naoqi.link import Link, LinkLost, Reply
from naoserver_naoqi.reporter import Reporter

__all__ = ["Errands", "Question"]

MOST: Final = 200
"""Calls that may go on at the same time; a robot that answers none gets no more."""
_AFTER_FAILURE: Final = 2.0


class Errands:
    """Begin calls, and tell of those that failed once they have."""

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
            try:
                reply.result(0.0)
            except LinkLost:
                continue
            except HardwareFailure as error:
                self._reporter.tell_once(operation, str(error))
            else:
                self._reporter.tell_once(operation, "")

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
        reply = self._reply
        if reply is not None and reply.done:
            self._reply, self._due = None, self._asked + self._period()
            self._receive(reply)
        if self._reply is None and self._now() >= self._due:
            self._asked = self._now()
            self._reply = link.begin(self._operation, *self._arguments)

    def _receive(self, reply: Reply) -> None:
        try:
            self._take(reply.result(0.0), self._asked)
            self._reporter.tell_once(self._operation, "")
        except LinkLost:
            pass  # the connection tells it
        except HardwareFailure as error:
            self._due = self._now() + _AFTER_FAILURE
            self._reporter.tell_once(self._operation, str(error))
