"""The real robot: the parts that make it a `Robot`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Final

from naoserver.assembly import Assembly
from naoserver.body import H25
from naoserver.capabilities import Stage
from naoserver.robot import BodyState, CameraFacts, Frame, JointDevice, JointFacts, JointReading
from naoserver_naoqi.cameras import NaoqiCameras
from naoserver_naoqi.care import Care, Wishes
from naoserver_naoqi.connection import Connection
from naoserver_naoqi.errands import Errands
from naoserver_naoqi.joints import NaoqiJoints
from naoserver_naoqi.lights import NaoqiLights
from naoserver_naoqi.link import Link
from naoserver_naoqi.postures import NaoqiPostures
from naoserver_naoqi.reporter import Reporter
from naoserver_naoqi.sonar import NaoqiSonar
from naoserver_naoqi.state import NaoqiSenses, NaoqiState
from naoserver_naoqi.voice import NaoqiVoice
from naoserver_naoqi.walk import NaoqiWalker
from zenoh_ice import Clock, WallClock

__all__ = ["NaoqiRobot"]


class NaoqiRobot:
    """A Nao H25 with NAOqi. Implements Robot.

    `connect` makes a link to it within some seconds. While the robot is lost, readings stay what they were
    and commands do nothing; `report_to` lets a server tell its clients.
    """

    def __init__(
        self, connect: Callable[[float], Link], wishes: Wishes | None = None, clock: Clock | None = None
    ) -> None:
        self.name: Final = "Nao"
        self.clock: Final = clock or WallClock()
        now = self.clock.now
        self._reporter = Reporter()
        self._connection = Connection(connect, self.clock, self._reporter)
        connection, reporter = self._connection, self._reporter
        self._state = NaoqiState(self.clock)
        self._errands = Errands(connection, reporter)
        self._care = Care(wishes or Wishes(), connection, reporter)
        self._joints = NaoqiJoints(connection, self._state, self._errands, reporter)
        self._walker = NaoqiWalker(connection, self._state, self.clock, reporter)
        self._cameras = NaoqiCameras(connection, now)
        self._sonar = NaoqiSonar()
        self._senses = NaoqiSenses(self._state)
        self._lights = NaoqiLights(self._errands, now)
        self._voice = NaoqiVoice(connection, self._errands, reporter)
        self._postures = NaoqiPostures(connection, self._errands, reporter, now)
        self._closed = False
        self._wire()

    @property
    def joints(self) -> tuple[JointFacts, ...]:
        """The joints of an H25."""
        return H25.joints

    @property
    def cameras(self) -> tuple[CameraFacts, ...]:
        """The head's two cameras, as this robot has them once it was started."""
        return self._cameras.facts

    @property
    def mechanisms(self) -> tuple[JointDevice, ...]:
        """Nothing: there are no balls beside it."""
        return ()

    @property
    def walker(self) -> NaoqiWalker:
        """Its walk."""
        return self._walker

    @property
    def senses(self) -> NaoqiSenses:
        """Its senses."""
        return self._senses

    @property
    def lights(self) -> NaoqiLights:
        """Its lights."""
        return self._lights

    @property
    def voice(self) -> NaoqiVoice:
        """Its voice."""
        return self._voice

    @property
    def postures(self) -> NaoqiPostures:
        """NAOqi's own way into postures."""
        return self._postures

    @property
    def stage(self) -> Stage | None:
        """None: nobody places a real robot by a command."""
        return None

    def read(self) -> JointReading:
        """Return the newest snapshot of the joints."""
        return self._state.joints()

    def state(self) -> BodyState:
        """Return how the body is, by the inertial unit."""
        return self._state.body()

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        """Move the setpoints of some joints to `targets`."""
        if not self._closed:
            self._joints.command_positions(targets, max_speeds)

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        """Move the setpoints of some joints at `velocities` until further notice."""
        if not self._closed:
            self._joints.command_velocities(velocities)

    def command_stiffnesses(self, stiffnesses: Mapping[str, float], seconds: float) -> None:
        """Change how strongly some motors hold."""
        if not self._closed:
            self._joints.command_stiffnesses(stiffnesses, seconds)

    def capture(self, camera: str, width: int, height: int) -> Frame:
        """Take a picture; blocks at most 1 s. Raises HardwareFailure."""
        return self._cameras.capture(camera, width, height)

    def report_to(self, assembly: Assembly) -> None:
        """Tell clients what happens to the robot, at once when it is lost; then no command gets through."""
        self._reporter.report_to(assembly.events, assembly.health.tell)
        self._connection.on_lost.append(assembly.gate.lose)
        self._connection.on_found.append(assembly.gate.find)

    def start(self) -> None:
        """Connect, and bring the robot into the state in which it is to be served. Raises RobotError."""
        self._connection.start()
        self._joints.start()
        self._walker.start()
        self._care.begin()

    def close(self) -> None:
        """Stop all motion, leave the robot as the operator wishes, release what it gave, and hang up."""
        if self._closed:
            return
        self._closed = True
        with ExitStack() as steps:  # run from the last to the first, each whatever the others raise
            steps.callback(self._state.freeze)
            steps.callback(self._connection.close)
            steps.callback(lambda: self._sonar.close(self._connection.link))
            steps.callback(self._cameras.close)
            steps.callback(self._care.end)
            steps.callback(self._joints.close)
            steps.callback(self._walker.close)
            steps.callback(self._voice.stop)

    def _wire(self) -> None:
        """Let the connection tell each part what it has to do."""
        connection = self._connection
        questions = (*self._walker.questions, self._postures.question)
        connection.on_open.extend(
            (self._state.open, self._walker.open, self._care.open, self._cameras.open, self._sonar.open)
        )
        connection.on_open.append(self._postures.open)
        connection.on_open.extend(question.open for question in questions)
        connection.on_tick.append(self._state.tick)
        connection.on_tick.extend(question.tick for question in questions)
        connection.on_tick.extend((self._postures.tick, self._voice.tick, self._errands.tick))
        connection.on_lost.append(lambda _why: self._forget())

    def _forget(self) -> None:
        self._state.freeze()
        for part in (self._joints, self._voice, self._postures, self._errands):
            part.forget()
        self._walker.lose()
