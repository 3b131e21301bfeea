"""Servos on a bus as a whole robot: setpoints in small steps, single servos and the bus lost and found."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from naoserver.bodies import capabilities
from naoserver.bodies.body import Body
from naoserver.bodies.description import write_looks
from naoserver.bodies.parts import JointFacts
from naoserver.errors import HardwareFailure, RobotError
from naoserver.hardware.connection import Connection, HardwareLimits, Link, LinkLost, Reporter
from naoserver.hardware.lifecycle import End, Lifecycle, Start
from naoserver.protocol.faults import Faults
from naoserver.protocol.jobs import ControlLoop
from naoserver.protocol.robot import LIMP, BodyState, Frame, JointDevice, JointFault, JointReading
from zenoh_ice import Clock, WallClock
from zenoh_ice.data.text import sentence

SERVO_LIMITS: Final = HardwareLimits(silence=0.5)
"""How often a bus is polled, and how long it is waited for."""
_FRESH: Final = 0.1
"""Seconds after an answer for which a setpoint moves on: a silent servo is not sent anywhere."""
_SETTLED: Final = 0.3
"""Seconds after which a servo reports the stiffness that it was given."""


@dataclass(frozen=True, slots=True)
class Servo:
    """What a servo reports of its joint, in SI units and rad, as the body's description counts its angle."""

    position: float
    velocity: float = 0.0
    torque: float = 0.0
    stiffness: float = 1.0
    """From 0, limp, to 1."""
    temperature: float = 0.0
    """In degrees Celsius; 0 when it reports none."""
    fault: str = ""
    """What keeps it from holding, such as `overload: its torque is off`; empty if nothing does."""

    @property
    def values(self) -> tuple[float, ...]:
        """All that it measures."""
        return self.position, self.velocity, self.torque, self.stiffness, self.temperature


class ServoBus(Link, Protocol):
    """A line with a servo for each joint. One thread makes all calls; another one closes a line that hangs.

    Every method may raise HardwareFailure or OSError: then the line is lost, and is opened again.
    """

    def read(self) -> Mapping[str, Servo]:
        """Return what each servo reports, by joint, without those that did not answer in time.

        One with a value that is no finite number counts as if it had not answered. It takes less than a
        period, 20 ms: an answer that comes later must not be taken for the next one.
        """

    def move(self, setpoints: Mapping[str, float]) -> None:
        """Send servos to setpoints in rad, a small step away, as fast as they can."""

    def stiffen(self, stiffnesses: Mapping[str, float]) -> None:
        """Let servos hold, or go limp: from 0 to 1."""


@dataclass(slots=True)
class _Joint:
    """A joint with its servo, and where that is sent."""

    facts: JointFacts
    servo: Servo
    setpoint: float
    stiffness: float = 0.0
    goal: float = 0.0
    speed: float = 0.0
    """With which the setpoint moves to the goal."""
    heard: float = -math.inf
    """When the servo answered."""
    changed: float = -math.inf
    """When it was sent a stiffness."""

    def receive(self, servo: Servo, now: float, silence: float) -> None:
        """Receive a reading; the setpoint of a servo that is limp, or was silent so long, is where it is."""
        found = now - self.heard > silence
        self.servo, self.heard = servo, now
        if found or now - self.changed > _SETTLED:
            self.stiffness = servo.stiffness
        if found or self.stiffness < LIMP:
            self.setpoint, self.speed = servo.position, 0.0

    def step(self, seconds: float) -> None:
        """Move the setpoint on towards the goal, within the range."""
        way = min(max(self.goal, self.facts.lower), self.facts.upper) - self.setpoint
        most = self.speed * seconds
        self.setpoint += min(max(way, -most), most)


Capture = Callable[[str, int, int], Frame]
"""Takes an image, as `Robot.capture` does."""


def _answers_of(bus: ServoBus) -> dict[str, Servo]:
    """Return what servos report in numbers: a setpoint must never come from one that sends none."""
    return {name: servo for name, servo in bus.read().items() if all(map(math.isfinite, servo.values))}


class ServoRobot:
    """A robot with servos on a bus. Implements Robot; subclasses may add parts, such as a voice.

    `connect` opens the bus within some seconds, or raises HardwareFailure or OSError; it is called again and
    again while the bus is lost. A servo that does not answer at the start is lost until it does. Goals are
    passed on in small steps, and none from before a loss. `start` and `end` say what its motors do then.
    """

    mechanisms: tuple[JointDevice, ...] = ()
    gains: capabilities.GainControl | None = None
    walker: capabilities.Walker | None = None
    balancer: capabilities.Balancer | None = None
    lights: capabilities.Lights | None = None
    voice: capabilities.Voice | None = None
    loudspeaker: capabilities.Loudspeaker | None = None
    eyes: capabilities.Eyes | None = None
    postures: capabilities.OwnPostures | None = None
    stage: capabilities.Stage | None = None
    faults: Faults | None = None
    control_loop: ControlLoop | None = None

    def __init__(
        self,
        body: Body,
        connect: Callable[[float], ServoBus],
        *,
        capture: Capture | None = None,
        senses: capabilities.Senses | None = None,
        start: Start = Start.LEAVE,
        end: End = End.LEAVE,
        clock: Clock | None = None,
        limits: HardwareLimits = SERVO_LIMITS,
    ) -> None:
        self.name: Final = body.title or body.name
        if not body.joints:
            raise RobotError(f"{self.name} has no joint: it is no robot of servos")
        self.body: Final = body
        self.joints: Final = body.joints
        self.cameras: Final = body.cameras if capture else ()
        self.senses: Final = senses
        self.clock: Final[Clock] = clock or WallClock()
        self._capture = capture
        reporter, stiff = Reporter(self.name), dict.fromkeys(body.joint_names, 1.0)
        self._connection = Connection(connect, self.clock, reporter, limits)
        self.lifecycle: Final[Lifecycle[ServoBus]] = Lifecycle(
            self._connection,
            reporter,
            (lambda _bus: self.command_stiffnesses(stiff, 0.0)) if start is Start.STIFFEN else None,
            (lambda bus: bus.stiffen(dict.fromkeys(stiff, 0.0))) if end is End.LIMP else None,
        )
        self._connection.on_open.append(self._open)
        self._connection.on_tick.append(self._tick)
        self._connection.on_lost.append(lambda _why: self._forget())
        self._connection.on_close.append(self.lifecycle.end)
        self._lock = threading.Lock()  # of what commands change; held for microseconds
        resting = body.resting_angles
        self._joints = {
            joint.name: _Joint(joint, Servo(resting[joint.name]), resting[joint.name])
            for joint in body.joints
        }
        self._changes: dict[str, float] = {}  # of stiffnesses, to be sent
        self._ticked = self.clock.now()
        self._closed = False
        self._reading = self._reading_at(self._ticked)

    def looks(self) -> str:
        return write_looks(self.body)

    def read(self) -> JointReading:
        return self._reading

    def state(self) -> BodyState:
        inertial = self.senses.inertial() if self.senses else capabilities.InertialReading()
        fallen = not self.body.mounted and inertial.tilt > self.body.lying_tilt
        return BodyState(inertial.tilt, fallen, 0.0 if self._connection.link is None else 1.0, 0.0)

    def capture(self, camera: str, width: int, height: int) -> Frame:
        if self._closed:
            raise HardwareFailure(f"{camera}: the robot is closed")
        if self._capture is None or camera not in {each.name for each in self.cameras}:
            raise HardwareFailure(sentence(f"there is no camera {camera!r}"))
        return self._capture(camera, width, height)

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        self._command({joint: (target, max_speeds[joint]) for joint, target in targets.items()})

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        self._command(
            {joint: (math.copysign(math.inf, rate), abs(rate)) for joint, rate in velocities.items()}
        )

    def command_stiffnesses(self, stiffnesses: Mapping[str, float], seconds: float) -> None:  # noqa: ARG002
        """Change how strongly motors hold, at once."""
        with self._lock:
            if self._connection.link is not None:
                self._changes.update(stiffnesses)

    def start(self) -> None:
        self._connection.start()
        self.lifecycle.begin()

    def close(self) -> None:
        """Hold every joint, leave it as the options say, and close the bus."""
        self._closed = True
        self._forget()
        self._connection.close()

    def _command(self, goals: Mapping[str, tuple[float, float]]) -> None:
        with self._lock:
            if self._connection.link is not None and not self._closed:
                for name, goal in goals.items():
                    self._joints[name].goal, self._joints[name].speed = goal

    def _forget(self) -> None:
        """Let setpoints rest where they are."""
        with self._lock:
            self._changes.clear()
            for joint in self._joints.values():
                joint.speed = 0.0

    # On the thread of the bus.

    def _open(self, bus: ServoBus) -> None:
        """Find the servos on a new line, where they are. Raises LinkLost when none answers twice in a row."""
        found: dict[str, Servo] = {}
        answers: Mapping[str, Servo] = {}
        deadline = self.clock.now() + self._connection.limits.answer
        while self.clock.now() < deadline:
            answers = _answers_of(bus)
            if answers and len(found) == len(self.joints):
                break
            found.update(answers)
        if not answers:
            raise LinkLost("no servo answers")
        now = self.clock.now()
        with self._lock:
            for joint in self._joints.values():
                joint.heard = -math.inf
            self._receive(found, now)
            self._reading = self._reading_at(now)

    def _tick(self, bus: ServoBus) -> None:
        """Read all servos, and send them a step on."""
        found = _answers_of(bus)
        now = self.clock.now()
        seconds, self._ticked = min(now - self._ticked, 2 * self._connection.limits.period), now
        with self._lock:
            changes, self._changes = self._changes, {}
            for name, stiffness in changes.items():
                self._joints[name].stiffness, self._joints[name].changed = stiffness, now
            self._receive(found, now)
            reached = {name: joint for name, joint in self._joints.items() if not self._is_lost(joint, now)}
            if not reached:
                raise LinkLost(f"no servo has answered for {self._connection.limits.silence:g} s")
            for joint in reached.values():
                if now - joint.heard < _FRESH:
                    joint.step(seconds)
            setpoints = {name: joint.setpoint for name, joint in reached.items() if joint.stiffness >= LIMP}
            if found:
                self._reading = self._reading_at(now)
        if changes := {name: value for name, value in changes.items() if name in reached}:
            bus.stiffen(changes)
        bus.move(setpoints)

    def _receive(self, found: Mapping[str, Servo], now: float) -> None:
        """Receive readings of servos. Raises HardwareFailure for one of another robot."""
        for name, servo in found.items():
            if name not in self._joints:
                raise HardwareFailure(f"the bus reports a joint {name!r}, which {self.name} lacks")
            self._joints[name].receive(servo, now, self._connection.limits.silence)

    def _is_lost(self, joint: _Joint, now: float) -> bool:
        return now - joint.heard > self._connection.limits.silence

    def _fault_of(self, joint: _Joint, now: float) -> JointFault | None:
        if self._is_lost(joint, now):
            return JointFault("lost: its servo does not answer", lost=True)
        return JointFault(joint.servo.fault) if joint.servo.fault else None

    def _reading_at(self, now: float) -> JointReading:
        joints = self._joints.values()
        faults = {joint.facts.name: self._fault_of(joint, now) for joint in joints}
        return JointReading(
            now,
            tuple(joint.servo.position for joint in joints),
            tuple(joint.servo.velocity for joint in joints),
            tuple(joint.setpoint for joint in joints),
            tuple(joint.servo.torque for joint in joints),
            tuple(joint.stiffness for joint in joints),
            tuple(joint.servo.temperature for joint in joints),
            {name: fault for name, fault in faults.items() if fault is not None},
        )
