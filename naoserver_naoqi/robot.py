"""The real robot: the parts that make it a `Robot`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Final

from naoserver.assembly import Assembly
from naoserver.body import H25
from naoserver.robot import BodyState, CameraFacts, Frame, JointReading
from naoserver_naoqi.cameras import NaoqiCameras
from naoserver_naoqi.care import Care, Wishes
from naoserver_naoqi.connection import Connection, Reporter
from naoserver_naoqi.errands import Errands
from naoserver_naoqi.expression import NaoqiLights, NaoqiVoice
from naoserver_naoqi.joints import NaoqiJoints
from naoserver_naoqi.link import Link
from naoserver_naoqi.postures import NaoqiPostures
from naoserver_naoqi.state import NaoqiSenses, NaoqiState
from naoserver_naoqi.walk import NaoqiWalker
from zenoh_ice import Clock, WallClock


class NaoqiRobot:
    """A Nao H25 with NAOqi. Implements Robot.

    `connect` makes a link to it within some seconds. While the robot is lost, readings stay what they were
    and commands do nothing; `report_to` lets a server tell its clients.
    """

    def __init__(
        self, connect: Callable[[float], Link], wishes: Wishes | None = None, clock: Clock | None = None
    ) -> None:
        self.name: Final = "Nao"
        self.joints: Final = H25.joints
        self.mechanisms: Final = ()
        self.stage: Final = None
        self.clock: Final = clock or WallClock()
        now = self.clock.now
        self._reporter = Reporter()
        self._connection = Connection(connect, self.clock, self._reporter)
        connection, reporter = self._connection, self._reporter
        self._state = NaoqiState(self.clock)
        self._errands = Errands(connection, reporter)
        self._care = Care(wishes or Wishes(), connection, reporter)
        self._commands = NaoqiJoints(connection, self._state, self._errands, reporter)
        self.walker: Final = NaoqiWalker(connection, self._state, self.clock, reporter)
        self._cameras = NaoqiCameras(connection, now)
        self.senses: Final = NaoqiSenses(self._state)
        self.lights: Final = NaoqiLights(self._errands, now)
        self.voice: Final = NaoqiVoice(connection, self._errands, reporter)
        self.postures: Final = NaoqiPostures(connection, self._errands, reporter, now)
        self._closed = False
        self._wire()

    @property
    def cameras(self) -> tuple[CameraFacts, ...]:
        """The head's two cameras, as this robot has them once it was started."""
        return self._cameras.facts

    def read(self) -> JointReading:
        """Return the newest snapshot of the joints."""
        return self._state.joints()

    def state(self) -> BodyState:
        """Return how the body is, by the inertial unit."""
        return self._state.body()

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        """Move the setpoints of some joints to `targets`."""
        if not self._closed:
            self._commands.command_positions(targets, max_speeds)

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        """Move the setpoints of some joints at `velocities` until further notice."""
        if not self._closed:
            self._commands.command_velocities(velocities)

    def command_stiffnesses(self, stiffnesses: Mapping[str, float], seconds: float) -> None:
        """Change how strongly some motors hold."""
        if not self._closed:
            self._commands.command_stiffnesses(stiffnesses, seconds)

    def capture(self, camera: str, width: int, height: int) -> Frame:
        """Take a picture; blocks at most 1 s. Raises HardwareFailure."""
        return self._cameras.capture(camera, width, height)

    def report_to(self, assembly: Assembly) -> None:
        """Tell clients what happens to the robot, at once when it is lost; then no command gets through."""
        self._reporter.report_to(assembly.events, assembly.health.report_now)
        self._connection.on_lost.append(assembly.gate.lose)
        self._connection.on_found.append(assembly.gate.find)

    def start(self) -> None:
        """Connect, and bring the robot into the state in which it is to be served. Raises RobotError."""
        self._connection.start()
        self._care.begin()

    def close(self) -> None:
        """Stop all motion, leave the robot as the operator wishes, release what it gave, and hang up."""
        if self._closed:
            return
        self._closed = True
        with ExitStack() as steps:  # run from the last to the first, each whatever the others raise
            steps.callback(self._state.freeze)
            steps.callback(self._connection.close)
            steps.callback(lambda: self.senses.close(self._connection.link))
            steps.callback(self._cameras.close)
            steps.callback(self._care.end)
            steps.callback(self._commands.close)
            steps.callback(self.walker.close)
            steps.callback(self.voice.stop)

    def _wire(self) -> None:
        """Let the connection tell each part what it has to do."""
        connection = self._connection
        questions = (*self.walker.questions, self.postures.question)
        parts = (self._state, self.walker, self._care, self._cameras, self.senses, self.postures, *questions)
        connection.on_open.extend(part.open for part in parts)
        connection.on_tick.append(self._state.tick)
        connection.on_tick.extend(question.tick for question in questions)
        connection.on_tick.extend((self.postures.tick, self.voice.tick, self._errands.tick))
        connection.on_lost.append(lambda _why: self._forget())

    def _forget(self) -> None:
        self._state.freeze()
        for part in (self._commands, self.voice, self.postures, self._errands):
            part.forget()
        self.walker.lose()
