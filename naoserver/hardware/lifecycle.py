"""What a robot does before it is served, and when its server ends."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from enum import StrEnum
from typing import Generic

from interfaces.nao import Severity
from naoserver.errors import HardwareFailure
from naoserver.hardware.connection import Connection, L, LinkLost, Reporter
from naoserver.serving.assembly import Assembly
from zenoh_ice.data.text import sentence


class Start(StrEnum):
    """Action of a robot with servos before it is served."""

    LEAVE = "leave"  # nothing: a limp robot stays limp
    STIFFEN = "stiffen"  # hold every joint where it is


class End(StrEnum):
    """Action of a robot with servos when its server ends."""

    LEAVE = "leave"  # stay as it is, also stiff
    LIMP = "limp"  # let every motor go limp


class Lifecycle(Generic[L]):
    """Bring a robot into its states for the start and the end; one that is stopped stays as it is.

    `start` and `end` do so over the link, within some seconds, and may raise HardwareFailure or OSError; None
    leaves the robot as it is. A robot that is lost meanwhile is started again once it is found.
    """

    def __init__(
        self,
        connection: Connection[L],
        reporter: Reporter,
        start: Callable[[L], object] | None,
        end: Callable[[L], object] | None,
    ) -> None:
        self._connection = connection
        self._reporter = reporter
        self._start = start
        self._end = end
        self._begun = False
        self.is_stopped: Callable[[], bool] = lambda: False
        """Return whether the emergency stop is latched."""

    def report_to(self, assembly: Assembly) -> None:
        """Notify clients of the loss and the return of the robot, between which commands are refused."""
        self._reporter.report_to(assembly.events, assembly.health.report_now)
        self.is_stopped = lambda: assembly.gate.state().stopped
        self._connection.on_lost.append(assembly.gate.lose)
        self._connection.on_found.append(assembly.gate.find)

    def begin(self) -> None:
        """Bring the robot into the state in which it is to be served. Raises HardwareFailure."""
        self._begun = True
        if self._start is None:
            return
        if self.is_stopped():
            self._reporter.report(Severity.Warning, sentence("the robot is still stopped: it stays as it is"))
            return
        found = threading.Event()
        self._connection.on_found.append(found.set)
        deadline = time.monotonic() + self._connection.limits.start
        while why := self._lost_at_start(self._start):
            message = f"the robot was lost at its start ({why})"
            self._reporter.report(Severity.Warning, f"{message}; it is started again once it is found")
            left = deadline - time.monotonic()
            if left <= 0.0 or not found.wait(left):
                raise HardwareFailure(f"{message}, and not found within {self._connection.limits.start:g} s")
            found.clear()

    def _lost_at_start(self, start: Callable[[L], object]) -> str:
        """Start the robot; return why it was lost meanwhile. Raises HardwareFailure."""
        link = self._connection.link
        if link is None:
            return "it is not connected"
        try:
            start(link)
        except LinkLost as error:
            if self._connection.link is link:
                raise
            return str(error)
        # Whatever stops a robot whose server is silent may have ended the start without an error.
        return "" if self._connection.link is link else "the start was interrupted"

    def end(self) -> None:
        """Leave the robot as it is to be left; report what fails."""
        if self._end is None:
            return
        link = self._connection.link
        if link is None:
            if self._begun:
                self._reporter.report(Severity.Error, sentence("the robot is lost: it stays as it is"))
        elif self.is_stopped():
            self._reporter.report(Severity.Warning, sentence("the robot is stopped: it stays as it is"))
        else:
            try:
                self._end(link)
            except (HardwareFailure, OSError) as error:
                self._reporter.report(Severity.Error, f"the robot was not left as requested: {error}")
