"""The real robot: the parts that make it a `Robot`, and its states at start and end."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from interfaces.nao import Severity
from naoserver.assembly import Assembly
from naoserver.bodies.nao import H25
from naoserver.body import Body
from naoserver.errors import HardwareFailure
from naoserver.looks.description import write_looks
from naoserver.naoqi._background_calls import BackgroundCalls
from naoserver.naoqi._cameras import NaoqiCameras
from naoserver.naoqi._connection import Connection, NaoqiLimits, Reporter
from naoserver.naoqi._expression import NaoqiLights, NaoqiLoudspeaker, NaoqiVoice
from naoserver.naoqi._joints import NaoqiJoints
from naoserver.naoqi._link import CallFailed, Link, call
from naoserver.naoqi._moves import NaoqiPostures, NaoqiWalker
from naoserver.naoqi._state import NaoqiSenses, NaoqiState
from naoserver.parts import CameraFacts
from zenoh_ice import Clock, WallClock

_logger = logging.getLogger(__name__)

_DISABLED: Final = "disabled"
_POSTURE_LIMIT: Final = 60.0
"""Seconds for the robot to stand up, to crouch, or to change its Autonomous Life."""
_SECONDS: Final = 1.0
"""Seconds in which motors become stiff or limp."""


class Start(StrEnum):
    """Action of the robot before it is served."""

    LEAVE = "leave"  # nothing: a limp robot stays limp
    STIFFEN = "stiffen"  # hold every joint where it is
    STAND = "stand"  # wake up: hold every joint, and stand up


class End(StrEnum):
    """Action of the robot when the server ends."""

    LEAVE = "leave"  # stay as it is, also stiff
    REST = "rest"  # crouch, and let every motor go limp
    LIMP = "limp"  # let every motor go limp at once: for a robot that hangs, sits or lies


class Life(StrEnum):
    """Setting of Autonomous Life, which moves the robot without commands."""

    DISABLE = "disable"  # switch it off
    SUSPEND = "suspend"  # switch it off, and restore it at the end
    LEAVE = "leave"  # leave it on; it moves the head against other commands


@dataclass(frozen=True, slots=True)
class LifecycleOptions:
    """Actions of the robot at the start and at the end."""

    start: Start = Start.LEAVE
    end: End = End.LEAVE
    life: Life = Life.DISABLE


class Lifecycle:
    """Bring the robot into the states for the start and the end that the options select."""

    def __init__(self, options: LifecycleOptions, connection: Connection, reporter: Reporter) -> None:
        self._options = options
        self._connection = connection
        self._reporter = reporter
        self._life_before = ""
        self._begun = False
        self.is_stopped: Callable[[], bool] = lambda: False
        """Return whether the emergency stop is latched: then the robot stays as it is."""

    def open(self, link: Link) -> None:
        """Switch off Autonomous Life, each time the robot is found: it starts with the robot."""
        if self._options.life is Life.LEAVE:
            return
        try:
            state = str(call(link, "ALAutonomousLife.getState"))
        except CallFailed as error:
            _logger.debug("no Autonomous Life: %s", error)
            return
        if state != _DISABLED:
            self._life_before = self._life_before or state
            call(link, "ALAutonomousLife.setState", _DISABLED, timeout=_POSTURE_LIMIT)
            self._reporter.report(Severity.Info, f"Autonomous Life was {state}, and is switched off")

    def begin(self) -> None:
        """Bring the robot into the state in which it is to be served. Raises HardwareFailure."""
        self._begun = True
        if self._options.start is not Start.LEAVE and self.is_stopped():
            self._reporter.report(Severity.Warning, "the robot is still stopped: it stays as it is")
        elif self._options.start is Start.STAND:
            call(self._connection.require(), "ALMotion.wakeUp", timeout=_POSTURE_LIMIT)
        elif self._options.start is Start.STIFFEN:
            _stiffen(self._connection.require(), 1.0)

    def end(self) -> None:
        """Leave the robot as the options select; report failures, and do the rest."""
        link = self._connection.link
        if link is None:
            if self._begun and self._options.end is not End.LEAVE:
                self._reporter.report(Severity.Error, "the robot is lost: it stays as it is")
            return
        if self.is_stopped():
            self._reporter.report(Severity.Warning, "the robot is stopped: it stays as it is")
            return
        try:
            if self._options.end is End.REST:
                call(link, "ALMotion.rest", timeout=_POSTURE_LIMIT)
            elif self._options.end is End.LIMP:
                _stiffen(link, 0.0)
            if self._options.life is Life.SUSPEND and self._life_before:
                call(link, "ALAutonomousLife.setState", self._life_before, timeout=_POSTURE_LIMIT)
        except HardwareFailure as error:
            self._reporter.report(Severity.Error, f"the robot was not left as requested: {error}")


def _stiffen(link: Link, stiffness: float) -> None:
    call(link, "ALMotion.stiffnessInterpolation", "Body", stiffness, _SECONDS, timeout=_POSTURE_LIMIT)


class NaoqiRobot:
    """A Nao with NAOqi. Implements Robot.

    `connect` makes a link to it within some seconds. While the robot is lost, readings keep their last values
    and commands do nothing; `report_to` lets a server notify its clients. A robot that is `stopped` since a
    former server does not move at the start. `clock` is that of its time: a virtual NAOqi may have another
    one than the wall's.
    """

    def __init__(
        self,
        connect: Callable[[float], Link],
        options: LifecycleOptions | None = None,
        body: Body = H25,
        *,
        stopped: bool = False,
        clock: Clock | None = None,
        limits: NaoqiLimits | None = None,
    ) -> None:
        self.name: Final = body.title or body.name
        self.body: Final = body
        self.joints: Final = body.joints
        self.mechanisms: Final = ()
        self.balancer: Final = None
        self.stage: Final = None
        self.control_loop: Final = None
        self.clock: Final[Clock] = clock or WallClock()
        now = self.clock.now
        reporter = self._reporter = Reporter()
        connection = self._connection = Connection(connect, self.clock, reporter, limits or NaoqiLimits())
        self._state = NaoqiState(self.clock, body, connection.limits)
        self.read: Final = self._state.joints
        self.state: Final = self._state.body
        self._calls = BackgroundCalls(connection, reporter)
        self._lifecycle = Lifecycle(options or LifecycleOptions(), connection, reporter)
        self._lifecycle.is_stopped = lambda: stopped
        self._commands = NaoqiJoints(connection, self._state, self._calls, reporter)
        self.command_positions: Final = self._commands.command_positions
        self.command_velocities: Final = self._commands.command_velocities
        self.command_stiffnesses: Final = self._commands.command_stiffnesses
        self.walker: Final = NaoqiWalker(connection, self._state, self.clock, reporter)
        self._cameras = NaoqiCameras(connection, now, body.cameras)
        self.capture: Final = self._cameras.capture
        self.senses: Final = NaoqiSenses(self._state)
        self.lights: Final = NaoqiLights(self._calls, now, body.lights)
        self.voice: Final = NaoqiVoice(connection, self._calls, reporter)
        self.loudspeaker: Final = NaoqiLoudspeaker(connection, reporter, now)
        self.postures: Final = NaoqiPostures(connection, self._calls, reporter, now)
        self._closed = False
        self._release: Callable[[], None] = lambda: None
        self._wire()

    @property
    def cameras(self) -> tuple[CameraFacts, ...]:
        return self._cameras.facts

    def looks(self) -> str:
        return write_looks(self.body)

    def report_to(self, assembly: Assembly) -> None:
        """Notify clients of the robot's events, at once of its loss, during which commands are refused."""
        self._reporter.report_to(assembly.events, assembly.health.report_now)
        self._lifecycle.is_stopped = lambda: assembly.gate.state().stopped
        self._connection.on_lost.append(assembly.gate.lose)
        self._connection.on_found.append(assembly.gate.find)

    def report_to_switch(self, beat: Callable[[Link], None], release: Callable[[], None]) -> None:
        """Call `beat` each time the robot has answered, and `release` at the end if it has been stopped."""
        self._connection.on_tick.append(beat)
        self._release = release

    def start(self) -> None:
        self._connection.start()
        self._lifecycle.begin()

    def close(self) -> None:
        """Stop all motion, leave the robot as the options select, release its resources, and disconnect."""
        if self._closed:
            return
        self._closed = True
        with ExitStack() as steps:  # all run, the last first, whatever they raise
            steps.callback(self._state.freeze)
            steps.callback(self._connection.close)
            steps.callback(self._release_if_stopped)
            steps.callback(lambda: self.senses.close(self._connection.link))
            steps.callback(self._cameras.close)
            steps.callback(self._lifecycle.end)
            steps.callback(self._commands.close)
            steps.callback(self.walker.close)
            steps.callback(self.voice.stop)
            steps.callback(self.loudspeaker.stop)

    def _release_if_stopped(self) -> None:
        """Report that the robot has carried out every stop, unless it is lost or refused one."""
        if self._connection.link is not None and self._commands.orders.idle and self.walker.stopped:
            self._release()

    def _wire(self) -> None:
        """Register the parts at the connection."""
        connection, questions = self._connection, (*self.walker.questions, self.postures.question)
        opened = (self._state, self.walker, self.postures, self._lifecycle, self._cameras, self.senses)
        ticking = (self._state, *questions, self.postures, self.voice, self.loudspeaker, self._calls)
        connection.on_open.extend(part.open for part in (*opened, *questions))
        connection.on_tick.extend(part.tick for part in ticking)
        connection.on_lost.append(self._forget)

    def _forget(self, _why: str) -> None:
        self._state.freeze()
        for part in (
            self._commands,
            self.voice,
            self.loudspeaker,
            self.postures,
            self._calls,
            self.walker,
        ):
            part.forget()
