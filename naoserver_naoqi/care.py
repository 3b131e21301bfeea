"""What happens to the robot itself when the server comes and goes: the operator decides."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from interfaces.nao import Severity
from naoserver.errors import HardwareFailure
from naoserver_naoqi.connection import Connection, Reporter
from naoserver_naoqi.link import CallFailed, Link, call

_logger = logging.getLogger(__name__)

_DISABLED: Final = "disabled"
_LONG: Final = 60.0
"""Seconds that the robot gets to stand up, to crouch, or to change its life."""
_SECONDS: Final = 1.0
"""In which motors become stiff or limp."""


class Start(StrEnum):
    """What the robot is to do before it is served."""

    LEAVE = "leave"
    """Nothing: a limp robot stays limp."""
    STIFFEN = "stiffen"
    """Hold every joint where it is."""
    STAND = "stand"
    """Wake up: hold every joint, and stand up."""


class End(StrEnum):
    """What the robot is to do when the server ends."""

    LEAVE = "leave"
    """Stay as it is, also stiff."""
    REST = "rest"
    """Crouch, and let every motor go limp."""
    LIMP = "limp"
    """Let every motor go limp at once: for a robot that hangs, sits or lies."""


class Life(StrEnum):
    """What becomes of Autonomous Life, which moves the robot by itself."""

    DISABLE = "disable"
    """Switch it off."""
    SUSPEND = "suspend"
    """Switch it off, and back to what it was at the end."""
    LEAVE = "leave"
    """Let it go on; it moves the head against whoever else does."""


@dataclass(frozen=True, slots=True)
class Wishes:
    """What the operator wants to happen to the robot."""

    start: Start = Start.LEAVE
    end: End = End.LEAVE
    life: Life = Life.DISABLE


class Care:
    """Do to the robot what the operator wishes."""

    def __init__(self, wishes: Wishes, connection: Connection, reporter: Reporter) -> None:
        self._wishes = wishes
        self._connection = connection
        self._reporter = reporter
        self._life_before = ""
        self._begun = False

    def open(self, link: Link) -> None:
        """Switch Autonomous Life off, each time the robot is found: it wakes up when the robot was off."""
        if self._wishes.life is Life.LEAVE:
            return
        try:
            state = str(call(link, "ALAutonomousLife.getState"))
        except CallFailed as error:
            _logger.debug("no Autonomous Life: %s", error)
            return
        if state != _DISABLED:
            self._life_before = self._life_before or state
            call(link, "ALAutonomousLife.setState", _DISABLED, timeout=_LONG)
            self._reporter.report(Severity.Info, f"Autonomous Life was {state}, and is switched off")

    def begin(self) -> None:
        """Bring the robot into the state in which it is to be served. Raises HardwareFailure."""
        self._begun = True
        if self._wishes.start is Start.STAND:
            self._connection.call("ALMotion.wakeUp", timeout=_LONG)
        elif self._wishes.start is Start.STIFFEN:
            self._stiffen(1.0)

    def end(self) -> None:
        """Leave the robot as the operator wishes; what fails is told, and the rest is done."""
        if self._connection.link is None:
            if self._begun and self._wishes.end is not End.LEAVE:
                self._reporter.report(Severity.Error, "the robot is lost: it stays as it is")
            return
        try:
            if self._wishes.end is End.REST:
                self._connection.call("ALMotion.rest", timeout=_LONG)
            elif self._wishes.end is End.LIMP:
                self._stiffen(0.0)
            if self._wishes.life is Life.SUSPEND and self._life_before:
                self._connection.call("ALAutonomousLife.setState", self._life_before, timeout=_LONG)
        except HardwareFailure as error:
            self._reporter.report(Severity.Error, f"the robot was not left as wished: {error}")

    def _stiffen(self, stiffness: float) -> None:
        self._connection.call("ALMotion.stiffnessInterpolation", "Body", stiffness, _SECONDS, timeout=_LONG)
