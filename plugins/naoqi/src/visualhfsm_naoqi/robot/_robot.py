"""The real robot: the parts that make it a `Robot`, and its states at start and end."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Final

from interfaces.nao import Severity
from naoserver.bodies.body import Body
from naoserver.bodies.description import write_looks
from naoserver.bodies.nao import H25
from naoserver.bodies.parts import CameraFacts
from naoserver.hardware.connection import CallFailed, Connection, HardwareLimits, Reporter
from naoserver.hardware.lifecycle import Lifecycle
from visualhfsm_naoqi.robot._cameras import NaoqiCameras
from visualhfsm_naoqi.robot._expression import NaoqiLights, NaoqiLoudspeaker, NaoqiVoice
from visualhfsm_naoqi.robot._moves import NaoqiJoints, NaoqiPostures, NaoqiWalker
from visualhfsm_naoqi.robot._state import NaoqiSenses, NaoqiState
from visualhfsm_naoqi.robot.background import BackgroundCalls
from visualhfsm_naoqi.robot.calls import CallLink, call
from zenoh_ice import Clock, WallClock

_logger = logging.getLogger(__name__)

_DISABLED: Final = "disabled"
_POSTURE_LIMIT: Final = 60.0
"""Seconds for the robot to stand up, to crouch, or to change its Autonomous Life."""
_SECONDS: Final = 1.0
"""Seconds in which motors become stiff or limp."""


class NaoStart(StrEnum):
    """Action of the robot before it is served."""

    LEAVE = "leave"  # nothing: a limp robot stays limp
    STIFFEN = "stiffen"  # hold every joint where it is
    STAND = "stand"  # wake up: hold every joint, and stand up


class NaoEnd(StrEnum):
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

    start: NaoStart = NaoStart.LEAVE
    end: NaoEnd = NaoEnd.LEAVE
    life: Life = Life.DISABLE


class _AutonomousLife:
    """Switch off what moves the robot without commands, and restore it at the end if it is only suspended."""

    def __init__(self, life: Life, reporter: Reporter) -> None:
        self._life = life
        self._reporter = reporter
        self._before = ""

    def open(self, link: CallLink) -> None:
        """Switch it off, each time the robot is found: it starts with the robot."""
        if self._life is Life.LEAVE:
            return
        try:
            state = str(call(link, "ALAutonomousLife.getState"))
        except CallFailed as error:
            _logger.debug("no Autonomous Life: %s", error)
            return
        if state != _DISABLED:
            self._before = self._before or state
            call(link, "ALAutonomousLife.setState", _DISABLED, timeout=_POSTURE_LIMIT)
            self._reporter.report(Severity.Info, f"Autonomous Life was {state}, and is switched off")

    def restore(self, link: CallLink) -> None:
        """Switch it on again, if it was only suspended."""
        if self._life is Life.SUSPEND and self._before:
            call(link, "ALAutonomousLife.setState", self._before, timeout=_POSTURE_LIMIT)


def _ending(options: LifecycleOptions, life: _AutonomousLife) -> Callable[[CallLink], object] | None:
    """Return what leaves the robot as the options say."""
    if options.end is NaoEnd.LEAVE and options.life is not Life.SUSPEND:
        return None

    def leave(link: CallLink) -> None:
        if options.end is NaoEnd.REST:
            call(link, "ALMotion.rest", timeout=_POSTURE_LIMIT)
        elif options.end is NaoEnd.LIMP:
            _stiffen(link, 0.0)
        life.restore(link)

    return leave


def _stiffen(link: CallLink, stiffness: float) -> None:
    call(link, "ALMotion.stiffnessInterpolation", "Body", stiffness, _SECONDS, timeout=_POSTURE_LIMIT)


_STARTS: Final[Mapping[NaoStart, Callable[[CallLink], object]]] = {
    NaoStart.STIFFEN: partial(_stiffen, stiffness=1.0),
    NaoStart.STAND: partial(call, operation="ALMotion.wakeUp", timeout=_POSTURE_LIMIT),
}
"""What brings the robot into the state for the start; nothing leaves it as it is."""


class NaoqiRobot:
    """A Nao with NAOqi. Implements Robot.

    `connect` makes a link to it within some seconds. While the robot is lost, readings keep their last values
    and commands do nothing; its `lifecycle` lets a server notify its clients. `clock` is that of its time: a
    virtual NAOqi may have another one than the wall's.
    """

    def __init__(
        self,
        connect: Callable[[float], CallLink],
        options: LifecycleOptions | None = None,
        body: Body = H25,
        *,
        clock: Clock | None = None,
        limits: HardwareLimits | None = None,
    ) -> None:
        self.name: Final = body.title or body.name
        self.body: Final = body
        self.joints: Final = body.joints
        self.mechanisms: Final = ()
        self.gains: Final = None
        self.balancer: Final = None
        self.stage: Final = None
        self.faults: Final = None
        self.eyes: Final = None
        self.control_loop: Final = None
        self.clock: Final[Clock] = clock or WallClock()
        now = self.clock.now
        reporter = Reporter("NAOqi")
        connection = self._connection = Connection(connect, self.clock, reporter, limits or HardwareLimits())
        self._state = NaoqiState(self.clock, body, connection.limits)
        self.read: Final = self._state.joints
        self.state: Final = self._state.body
        self._calls = BackgroundCalls(connection, reporter)
        options = options or LifecycleOptions()
        self._life = _AutonomousLife(options.life, reporter)
        self.lifecycle: Final = Lifecycle(
            connection, reporter, _STARTS.get(options.start), _ending(options, self._life)
        )
        self._commands = NaoqiJoints(connection, self._state, self._calls, reporter)
        self.command_positions: Final = self._commands.command_positions
        self.command_velocities: Final = self._commands.command_velocities
        self.command_stiffnesses: Final = self._commands.command_stiffnesses
        self.walker: Final = NaoqiWalker(connection, self._state, self.clock, reporter)
        self._cameras = NaoqiCameras(connection, now, body.cameras)
        self.capture: Final = self._cameras.capture
        self.senses: Final = NaoqiSenses(self._state)
        self.lights: Final = NaoqiLights(self._calls, now, body.lights)
        self.voice: Final = NaoqiVoice(connection, reporter)
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

    def report_to_switch(self, beat: Callable[[CallLink], None], release: Callable[[], None]) -> None:
        """Call `beat` each time the robot has answered, and `release` at the end if it has been stopped."""
        self._connection.on_tick.append(beat)
        self._release = release

    def start(self) -> None:
        self._connection.start()
        self.lifecycle.begin()

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
            steps.callback(self.lifecycle.end)
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
        opened = (self._state, self.walker, self.postures, self._life, self._cameras, self.senses)
        expression = (self.postures, self.voice, self.loudspeaker)
        ticking = (self._state, *questions, *expression, self._calls, self._commands)
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
