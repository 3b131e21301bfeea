"""Calls that nobody waits for, as the link may hang: single calls, polls, and queues of commands."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, Final, Generic, TypeVar

from interfaces.nao import Severity
from naoserver.errors import HardwareFailure
from naoserver.hardware.connection import LinkLost, Reporter, join
from visualhfsm_naoqi.robot.calls import CallConnection, CallLink, Failure, Reply

MOST_CALLS: Final = 200
"""Limit of unanswered calls; further ones are refused, unless they stop something."""
_AFTER_FAILURE: Final = 2.0

V = TypeVar("V")


class BackgroundCalls:
    """Start calls, and report failures."""

    def __init__(self, connection: CallConnection, reporter: Reporter) -> None:
        self._connection = connection
        self._reporter = reporter
        self._lock = threading.Lock()
        self._replies: list[tuple[str, Reply]] = []

    def run(self, operation: str, *arguments: object, urgent: bool = False) -> None:
        """Start a call, an urgent one however many are unanswered.

        Raises LinkLost while the robot is not connected, HardwareFailure when too many are unanswered.
        """
        link = self._connection.require()
        with self._lock:
            if len(self._replies) >= MOST_CALLS and not urgent:
                raise HardwareFailure(f"{operation}: the robot has not answered {MOST_CALLS} earlier calls")
            self._replies.append((operation, link.begin(operation, *arguments)))

    def runs(self, operation: str) -> bool:
        """Return whether a call of an operation is unanswered."""
        with self._lock:
            return any(name == operation and not reply.done for name, reply in self._replies)

    def tick(self, _link: CallLink) -> None:
        """Collect the answers that have arrived."""
        with self._lock:
            done = [each for each in self._replies if each[1].done]
            self._replies = [each for each in self._replies if each not in done]
        for operation, reply in done:
            with self._reporter.failures_of(operation):
                reply.result(0.0)

    def forget(self) -> None:
        """Drop all pending calls: the connection is lost."""
        with self._lock:
            self._replies = []


class Poll:
    """Repeat a call with a period, without waiting for the answer.

    `take` gets each answer and the time of its call in s; it may raise HardwareFailure. A failure is
    reported, and the call is repeated later.
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

    def open(self, _link: CallLink) -> None:
        """Restart on a new link."""
        self._reply, self._due = None, float("-inf")

    def tick(self, link: CallLink) -> None:
        """Take the answer if it has arrived, and call again when it is time."""
        if self._reply is not None and self._reply.done:
            reply, self._reply = self._reply, None
            self._due = self._now() + _AFTER_FAILURE
            with self._reporter.failures_of(self._operation):
                self._take(reply.result(0.0), self._asked)
                self._due = self._asked + self._period()
        if self._reply is None and self._now() >= self._due:
            self._asked = self._now()
            self._reply = link.begin(self._operation, *self._arguments)


class CoalescingQueue(Generic[V]):
    """A queue of commands that keeps the newest one for each key.

    Two calls may be run in either order, as NAOqi does, so each is sent after the answer to the previous one.
    The first is sent from the caller's thread. Later commands wait, and a newer command replaces an older one
    with the same key, so the queue stays short however slow the robot is. `send` starts the calls.

    A command that is a stop (`is_stop`) waits for no answer: it is sent at once, and again after the answers.
    It is repeated until the robot has carried it out, unless a newer one replaces it. A call that was not
    answered may still be run, so a stop is repeated after that, too.
    """

    def __init__(
        self,
        name: str,
        connection: CallConnection,
        reporter: Reporter,
        send: Callable[[CallLink, Mapping[str, V]], Sequence[Reply]],
        is_stop: Callable[[V], bool],
    ) -> None:
        self._name = name
        self._connection = connection
        self._reporter = reporter
        self._send = send
        self._is_stop = is_stop
        self._changed = threading.Condition()
        self._waiting: dict[str, V] = {}
        self._sent: dict[str, V] = {}  # the commands of the running calls
        self._replies: Sequence[Reply] = ()
        self._unanswered: list[Reply] = []  # calls before them that the robot may still run
        self._closing = False
        self._thread = threading.Thread(target=self._run, name=f"{reporter.source} {name}", daemon=True)

    @property
    def idle(self) -> bool:
        """Whether every command has been answered."""
        with self._changed:
            return not self._replies and not self._waiting

    def post(self, commands: Mapping[str, V]) -> None:
        """Send commands now, or after the previous answer; drop them without a connection.

        Raises HardwareFailure when no thread can be started for the answers; stops are sent even then.
        """
        with self._changed:
            if self._closing or self._connection.link is None:
                return
            failure = self._start()
            if failure is not None and not all(map(self._is_stop, commands.values())):
                raise HardwareFailure(f"{self._name}: not sent: {failure}") from failure
            self._waiting.update(commands)
            if not self._replies:
                self._send_waiting()
                if failure is not None:
                    self._replies = ()  # nobody takes the answers
                self._changed.notify_all()
            elif stops := {key: each for key, each in commands.items() if self._is_stop(each)}:
                self._send_beside(stops)

    def forget(self) -> None:
        """Drop the commands that have not been sent yet."""
        with self._changed:
            self._waiting.clear()
            self._unanswered.clear()

    def close(self) -> None:
        """Send the waiting commands, and end the thread."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        join(self._thread, self._connection.limits.end)

    def _send_waiting(self) -> None:
        link = self._connection.link
        if link is None:
            self._waiting.clear()
        elif self._waiting:
            self._sent, self._waiting = self._waiting, {}
            try:
                self._replies = self._send(link, self._sent)
            except HardwareFailure as error:
                self._replies = (Failure(error),)

    def _send_beside(self, stops: Mapping[str, V]) -> None:
        """Send stops that also wait, unless the calls before them are answered or were stops already."""
        link = self._connection.link
        new = {key: stop for key, stop in stops.items() if self._sent.get(key) != stop}
        if link is not None and new and not all(reply.done for reply in self._replies):
            self._sent = {**self._sent, **new}
            with suppress(HardwareFailure):  # they are sent again
                self._replies = (*self._replies, *self._send(link, new))

    def _start(self) -> RuntimeError | None:
        """Start the thread that takes the answers, unless it runs; return why it cannot be started."""
        try:
            if self._thread.ident is None:
                self._thread.start()
        except RuntimeError as error:  # at a limit of threads or memory; the next command tries again
            return error
        return None

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._replies or self._closing)
                replies = self._replies
                if not replies:
                    return
            failures = [failure for reply in replies if (failure := self._failure_of(reply))]
            with self._changed:
                in_doubt = bool(failures or self._unanswered)
                self._unanswered = [reply for reply in (*self._unanswered, *replies) if not reply.done]
                self._replies = self._replies[len(replies) :]  # those of stops that were sent meanwhile
                if in_doubt:
                    self._repeat_stops(failures)
                if not self._replies:
                    self._send_waiting()

    def _failure_of(self, reply: Reply) -> str:
        """Return why the robot has not carried out a call; empty if it has, or is lost."""
        try:
            reply.result(self._connection.limits.answer)
        except LinkLost:
            return ""  # the robot is stopped when it is found again
        except HardwareFailure as error:
            self._reporter.report_once(self._name, str(error))
            return str(error)
        self._reporter.report_once(self._name, "")
        return ""

    def _repeat_stops(self, failures: Sequence[str]) -> None:
        """Let the stops of the last calls wait, to be sent again soon, or with the next newer command."""
        stops = {key: command for key, command in self._sent.items() if self._is_stop(command)}
        stops = {key: command for key, command in stops.items() if key not in self._waiting}
        if not stops:
            return
        if failures:
            message = f"a stop ({self._name}) is repeated until the robot carries it out: {failures[0]}"
            self._reporter.report(Severity.Error, message, f"stop {self._name}")
        at_once = bool(self._waiting)
        self._waiting.update(stops)
        if not at_once:
            self._changed.wait_for(lambda: self._replies, self._connection.limits.repetition)
