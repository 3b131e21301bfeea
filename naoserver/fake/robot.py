"""A robot without physics: it moves as commanded, with a short lag, and sees balls that move with it.

It computes its state on request, exactly, from the time that has passed: without threads, and with the same
answers on a `VirtualClock` as on a wall clock. Its cameras draw balls as discs, by the
projection of a pinhole camera.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies import DEFAULT_BODY, capabilities, find_body
from naoserver.bodies.body import Body
from naoserver.bodies.description import write_looks
from naoserver.bodies.faults import LEDS, SOUNDS, SPEECH
from naoserver.bodies.kinematics import Matrix, kinematics_of, matrix_of
from naoserver.bodies.parts import Camera, CameraFacts, Coupling, JointFacts, Wheels
from naoserver.bodies.sight import CameraPlace, Thing
from naoserver.errors import HardwareFailure
from naoserver.protocol.expression import FadingLights, Ramp, TimedSounds, TimedVoice
from naoserver.protocol.failing_senses import FailingEyes, FailingSenses
from naoserver.protocol.faults import Faults
from naoserver.protocol.jobs import ControlLoop
from naoserver.protocol.robot import BodyState, Frame, JointReading
from naoserver.soccer_field import Field
from zenoh_ice import Clock, WallClock
from zenoh_ice.data.text import sentence

RADIUS: Final = 0.05
"""Radius of a ball in m."""
_GROUND: Final = 110

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball: its bearing in rad, positive to the left, its distance and its height above the floor in m."""

    pan: float
    distance: float
    height: float

    @property
    def place(self) -> Point:
        """Its middle in the robot's frame in m."""
        return self.distance * math.cos(self.pan), self.distance * math.sin(self.pan), self.height


def project(place: Matrix, ball: Ball) -> Point:
    """Return the centre of a ball in the frame of a camera in m: ahead, to the left, up.

    `place` is that of the camera in the robot's frame, as `naoserver.bodies.kinematics` returns it.
    """
    ahead, left, up = ((ball.place - place[:3, 3]) @ place[:3, :3]).tolist()
    return ahead, left, up


def paint(
    camera: CameraFacts,
    size: tuple[int, int],
    balls: Iterable[tuple[Point, tuple[int, int, int]]],
    ball_radius: float = RADIUS,
) -> NDArray[np.uint8]:
    """Return an RGB image of balls, each with its place and its color; `size` is width and height.

    A place is in the camera's frame, as `project` returns it. Nearer balls hide those behind them.
    """
    width, height = size
    image = np.full((height, width, 3), _GROUND, np.uint8)
    focal = camera.focal_length(width)
    for (ahead, left, up), color in sorted(balls, key=lambda placed: -placed[0][0]):
        if ahead <= ball_radius:
            continue
        column, row = width / 2 - focal * left / ahead, height / 2 - focal * up / ahead
        radius = focal * ball_radius / ahead
        rows = np.arange(max(0, math.floor(row - radius)), min(height, math.ceil(row + radius) + 1))
        columns = np.arange(max(0, math.floor(column - radius)), min(width, math.ceil(column + radius) + 1))
        if rows.size and columns.size:
            inside = (rows[:, None] + 0.5 - row) ** 2 + (columns + 0.5 - column) ** 2 <= radius**2
            image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1][inside] = color
    return image


def camera_place(body: Body, camera: Camera, angles: Mapping[str, float]) -> Matrix:
    """Return the place of a camera in the robot's frame."""
    kinematics = kinematics_of(body)
    link = kinematics.torso_place(angles) @ kinematics.link_place(camera.link, angles)
    return link @ matrix_of((*camera.position, 0.0, camera.tilt, 0.0))


def view(
    body: Body,
    camera: Camera,
    reading: JointReading,
    size: tuple[int, int],
    balls: Iterable[tuple[Ball, tuple[int, int, int]]],
) -> Frame:
    """Return what a camera of a body, with its joints as they are read, sees of balls of some colors."""
    angles = dict(zip(body.joint_names, reading.positions, strict=True))
    place = camera_place(body, camera, angles)
    seen = [(project(place, ball), color) for ball, color in balls]
    return Frame(camera.name, reading.time, *size, paint(camera, size, seen))


class FakeEyes:
    """See the balls that the cameras of a fake robot show. Implements Eyes."""

    field: Final = Field()

    def __init__(self, robot: FakeRobot) -> None:
        self._robot = robot

    def look(self) -> capabilities.SightReading:
        robot = self._robot
        reading, body = robot.read(), robot.body
        angles = dict(zip(body.joint_names, reading.positions, strict=True))
        torso = kinematics_of(body).torso_place(angles)
        balls = [(ball.name, Ball(*ball.read().positions)) for ball in robot.mechanisms]
        middles = np.array([ball.place for _, ball in balls]).reshape(-1, 3)
        seen: list[capabilities.SeenThing] = []
        for camera in body.cameras:
            place = camera_place(body, camera, angles)
            at = CameraPlace(camera, reading.time, place[:3, 3], place[:3, :3], torso[:3, :3])
            shown = at.shows(middles)
            things = [
                Thing("ball", _COLOR_NAMES[name])
                for (name, _), is_shown in zip(balls, shown, strict=True)
                if is_shown
            ]
            seen += at.see(things, middles[shown], middles[shown])
        return capabilities.SightReading(reading.time, tuple(seen))


_GRAVITY: Final = 9.81  # m/s2


class FakeSenses:
    """Feel like a robot that stands still, with nothing near, until `feel`. Implements Senses."""

    def __init__(self, clock: Clock, body: Body, failing: FailingSenses) -> None:
        self._failing = failing
        self.touch_names: Final = body.touch_sensors
        sonar = body.sonar
        self.sonar_range: Final = (sonar.nearest, sonar.farthest) if sonar else None
        self.sonar_cone: Final = sonar.cone if sonar else 0.0
        self._clock = clock
        self._lock = threading.Lock()
        foot = (
            capabilities.FootReading(*[_GRAVITY * body.mass / 8] * 4)
            if body.soles
            else capabilities.FootReading()
        )
        charged = capabilities.BatteryReading(charge=0.8, current=-1.9, temperature=30.0, plugged=False)
        self._reading = capabilities.SenseReading(
            time=clock.now(),
            left_foot=foot,
            right_foot=foot,
            battery=charged if body.battery else capabilities.BatteryReading(),
        )

    def read(self) -> capabilities.SenseReading:
        with self._lock:
            reading = replace(self._reading, time=self._clock.now())
        failing, feet = self._failing, (reading.left_foot, reading.right_foot)
        left, right = failing.feet(feet, capabilities.FootReading())
        reading = replace(reading, inertial=self.inertial(), left_foot=left, right_foot=right)
        return failing.others(reading)

    def inertial(self) -> capabilities.InertialReading:
        return self._failing.inertial(self._reading.inertial, self._clock.now())

    def feel(self, **feelings: Any) -> None:  # noqa: ANN401 - fields of SenseReading
        """Set what some senses, fields of `SenseReading`, feel from now on: to set a scene."""
        with self._lock:
            self._reading = replace(self._reading, **feelings)


LIMITS: Final = capabilities.WalkVelocity(forward=0.3, left=0.12, turn=0.9)
"""The highest velocity of each kind of a robot that takes steps: those of the simulated Nao."""


class FakeWalker:
    """Move at the commanded velocity from the moment of the command. Implements Walker."""

    ended = ""
    failed = False
    lag = 0.0
    balances = False

    def __init__(
        self, clock: Clock, joints: tuple[str, ...], limits: capabilities.WalkVelocity = LIMITS
    ) -> None:
        self.joints: Final = joints
        self.limits: Final = limits
        self._clock = clock
        self._lock = threading.Lock()  # held for microseconds
        self._velocity = capabilities.STILL
        self._odometry = capabilities.Odometry(clock.now(), 0.0, 0.0, 0.0)
        self._closed = False

    def command(self, velocity: capabilities.WalkVelocity) -> None:
        with self._lock:
            self._go_on()
            if not self._closed:
                self._velocity = velocity

    def commanded(self) -> capabilities.WalkVelocity:
        return self._velocity

    @property
    def walking(self) -> bool:
        """Whether it moves: it stops at once."""
        return self._velocity != capabilities.STILL

    def odometry(self) -> capabilities.Odometry:
        with self._lock:
            self._go_on()
            return self._odometry

    def close(self) -> None:
        """Stop for good."""
        with self._lock:
            self._go_on()
            self._velocity = capabilities.STILL
            self._closed = True

    def _go_on(self) -> None:
        """Move up to now: a constant velocity in its own frame leads along an arc of a circle."""
        before, velocity, now = self._odometry, self._velocity, self._clock.now()
        seconds = max(0.0, now - before.time)
        turned = velocity.turn * seconds
        half = turned / 2.0
        middle = before.heading + half
        chord = seconds * (math.sin(half) / half if half else 1.0)
        cosine, sine = chord * math.cos(middle), chord * math.sin(middle)
        self._odometry = capabilities.Odometry(
            time=now,
            x=before.x + velocity.forward * cosine - velocity.left * sine,
            y=before.y + velocity.forward * sine + velocity.left * cosine,
            heading=math.pi - (math.pi - before.heading - turned) % (2.0 * math.pi),
        )


class FakeDrive(FakeWalker):
    """Drive on two wheels as commanded, and count their turns."""

    def __init__(self, clock: Clock, wheels: Wheels) -> None:
        limits = capabilities.WalkVelocity(wheels.fastest, 0.0, wheels.fastest_turn)
        super().__init__(clock, (wheels.left, wheels.right), limits)
        self._wheels = wheels
        self._angles = (0.0, 0.0)

    def angles(self) -> Mapping[str, float]:
        """Return by how many rad each wheel has turned."""
        with self._lock:
            self._go_on()
            return dict(zip(self.joints, self._angles, strict=True))

    def speeds(self) -> Mapping[str, float]:
        """Return the speed of each wheel in rad/s."""
        wheels, velocity = self._wheels, self._velocity
        aside = velocity.turn * wheels.distance / 2.0
        ways = velocity.forward - aside, velocity.forward + aside
        return {wheel: way / wheels.radius for wheel, way in zip(self.joints, ways, strict=True)}

    def _go_on(self) -> None:
        before = self._odometry.time
        super()._go_on()
        seconds = max(0.0, self._odometry.time - before)
        left, right = (speed * seconds for speed in self.speeds().values())
        self._angles = (self._angles[0] + left, self._angles[1] + right)


def _walker_of(body: Body, clock: Clock) -> FakeWalker | None:
    """Return the walk of a body, by its kind."""
    if isinstance(body.walk, Wheels):
        return FakeDrive(clock, body.walk)
    return FakeWalker(clock, body.groups.legs) if body.walk else None


LAG: Final = 0.02
"""Time constant in s with which a joint follows its setpoint."""
_STIFFNESS: Final = 20.0  # N m for a rad between setpoint and position: that of the simulated upper body
_WARM: Final = 38.0  # degrees Celsius: a motor that holds without effort


class _Motion(NamedTuple):
    """The motion of a joint from `time` on: its setpoint moves at `rate` until `end`."""

    time: float
    setpoint: float
    position: float
    rate: float = 0.0
    end: float = 0.0

    def at(self, time: float) -> _Motion:
        """Return the motion at a later time.

        The position q follows the setpoint s by q' = (s - q) / LAG, solved exactly on each linear piece.
        """
        if self.rate == 0.0 and self.position == self.setpoint:
            return self  # at rest, as most joints are
        left, setpoint, position, rate = max(0.0, time - self.time), self.setpoint, self.position, self.rate
        if rate:
            piece = min(left, (self.end - setpoint) / rate)
            lagging = setpoint - rate * LAG
            position = lagging + rate * piece + (position - lagging) * math.exp(-piece / LAG)
            if piece < left:
                setpoint, rate = self.end, 0.0
            else:
                setpoint += rate * piece
            left -= piece
        if left > 0.0:
            position = setpoint + (position - setpoint) * math.exp(-left / LAG)
        return _Motion(max(time, self.time), setpoint, position, rate, self.end)

    def by(self, pair: Coupling) -> _Motion:
        """Return the motion of the joint that follows this one."""
        setpoint, position, end = (pair.of(at) for at in (self.setpoint, self.position, self.end))
        return _Motion(self.time, setpoint, position, pair.ratio * self.rate, end)

    def turned(self, angle: float) -> _Motion:
        """Return the motion of a joint that something else has turned by an angle."""
        return self._replace(
            setpoint=self.setpoint + angle, position=self.position + angle, end=self.end + angle
        )


class FakeDevice:
    """Joints that follow their setpoints with a first-order lag. Implements JointDevice."""

    def __init__(
        self,
        name: str,
        joints: tuple[JointFacts, ...],
        clock: Clock,
        posture: Mapping[str, float],
        couplings: tuple[Coupling, ...] = (),
    ) -> None:
        self.name: Final = name
        self.joints: Final = joints
        self._by_name = {joint.name: joint for joint in joints}
        self._clock = clock
        self._lock = threading.Lock()  # held for microseconds
        self._closed = False
        self._couplings = couplings
        firm, limp = Ramp(1.0, 1.0), Ramp(0.0, 0.0)
        self._stiffnesses = {joint.name: limp if joint.passive else firm for joint in joints}
        self._time = clock.now()
        self._motions = {joint.name: _Motion(self._time, 0.0, 0.0) for joint in joints}
        self._reading: JointReading | None = None
        """The newest reading; None after a command."""
        self.place({joint.name: posture.get(joint.name, 0.0) for joint in joints})

    def read(self) -> JointReading:
        with self._lock:
            reading = self._reading
            if reading is None or (reading.time != self._clock.now() and not self._closed):
                reading = self._reading = self._read()
            return reading

    def _read(self) -> JointReading:
        self._go_on()
        motions, now = self._motions.values(), self._time
        # Lists, because they are faster than generators.
        behind = [motion.setpoint - motion.position for motion in motions]
        return JointReading(
            time=now,
            positions=tuple([motion.position for motion in motions]),
            velocities=tuple([lag / LAG for lag in behind]),
            commands=tuple([motion.setpoint for motion in motions]),
            torques=tuple(
                [
                    min(max(_STIFFNESS * lag, -joint.max_torque), joint.max_torque) if lag else 0.0
                    for lag, joint in zip(behind, self.joints, strict=True)
                ]
            ),
            stiffnesses=tuple([ramp.at(now) for ramp in self._stiffnesses.values()]),
            temperatures=(_WARM,) * len(behind),
        )

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        self._command({name: (target, max_speeds[name]) for name, target in targets.items()})

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        self._command({name: (math.copysign(math.inf, v), abs(v)) for name, v in velocities.items()})

    def command_stiffnesses(self, stiffnesses: Mapping[str, float], seconds: float) -> None:
        """Change how strongly some motors hold; the joint of a limp motor stays where it is."""
        with self._lock:
            self._go_on()
            self._reading = None
            commanded = {} if self._closed else stiffnesses
            for name, value in commanded.items():
                if self._by_name[name].passive:
                    continue
                before = self._stiffnesses[name].at(self._time)
                self._stiffnesses[name] = Ramp(before, value, self._time, seconds)

    def command_gains(self, commands: Mapping[str, capabilities.JointCommand]) -> None:
        """Move joints by commands with gains to where their torques are 0: nothing else acts on them."""
        moves = {}
        for name, by in commands.items():
            torque = by.torque + by.kd * by.velocity
            target, speed = math.copysign(math.inf, torque), by.max_speed if torque else 0.0
            if by.kp > 0.0:
                target, speed = by.position + torque / by.kp, by.max_speed
            elif by.kd > 0.0:
                speed = min(speed, abs(torque) / by.kd)
            moves[name] = min(max(target, by.lower), by.upper), speed
        self._command(moves)

    def place(self, positions: Mapping[str, float]) -> None:
        """Put some joints at positions at once, where they rest: for tests, to set a scene."""
        with self._lock:
            self._go_on()
            now, self._reading = self._clock.now(), None
            for name, position in positions.items():
                facts = self._by_name[name]
                value = min(max(position, facts.lower), facts.upper)
                self._motions[name] = _Motion(now, value, value)
            self._lead(positions)

    def close(self) -> None:
        self.read()
        with self._lock:
            self._closed = True

    def _go_on(self) -> None:
        """Move every joint up to now; the setpoint of a limp motor is the position of its joint."""
        if self._closed:
            return
        now = self._time = self._clock.now()
        for name, ramp in self._stiffnesses.items():
            if not ramp.after and (limp_since := ramp.start + ramp.seconds) <= now:
                stopped = self._motions[name].at(limp_since)
                self._motions[name] = _Motion(stopped.time, stopped.position, stopped.position)
        self._motions = {name: motion.at(now) for name, motion in self._motions.items()}

    def _command(self, commands: Mapping[str, tuple[float, float]]) -> None:
        """Move setpoints to ends at speeds, all starting at the same moment."""
        with self._lock:
            self._go_on()
            if self._closed:
                return
            now, self._reading = self._time, None
            for name, (target, speed) in commands.items():
                if self._stiffnesses[name].at(now) == 0.0:
                    continue
                facts, motion = self._by_name[name], self._motions[name].at(now)
                end = min(max(target, facts.lower), facts.upper)
                rate = math.copysign(speed, end - motion.setpoint) if end != motion.setpoint else 0.0
                self._motions[name] = _Motion(now, motion.setpoint, motion.position, rate, end)
            self._lead(commands)

    def _lead(self, commanded: Collection[str]) -> None:
        """Let coupled joints move together: as the leader, or else as a follower that is commanded."""
        for pair in self._couplings:
            if pair.follower in commanded and pair.leader not in commanded:
                self._motions[pair.leader] = self._motions[pair.follower].by(pair.reversed())
        for pair in self._couplings:
            self._motions[pair.follower] = self._motions[pair.leader].by(pair)


_BALL_JOINTS: Final = (
    ("Pan", -math.pi, math.pi, 2.0, 10.0),
    ("Distance", 0.2, 3.0, 1.0, 10.0),
    ("Height", 0.0, 1.5, 1.0, 10.0),
)
_COLORS: Final = {"BallRed": (220, 30, 30), "BallGreen": (30, 200, 40)}
_COLOR_NAMES: Final = {"BallRed": "red", "BallGreen": "green"}


class FakeRobot(FakeDevice):
    """A robot without physics, of the body of a Nao by default. Implements Robot.

    With `camera_failure` every capture raises HardwareFailure with that text.
    """

    balancer: capabilities.Balancer | None = None
    postures: capabilities.OwnPostures | None = None
    stage: capabilities.Stage | None = None
    control_loop: ControlLoop | None = None

    def __init__(
        self,
        clock: Clock | None = None,
        *,
        posture: Mapping[str, float] | None = None,
        camera_failure: str | None = None,
        body: Body | None = None,
    ) -> None:
        self.clock: Final[Clock] = clock or WallClock()
        self.body: Final = body or find_body(DEFAULT_BODY)
        body = self.body
        self.faults: Final = Faults(body, self.clock)
        self._failing = FailingSenses(self.faults, body)
        self._random = np.random.default_rng(0)
        self._stuck: dict[str, float] = {}  # where joints stay
        self._loose: dict[str, float] = {}  # where joints lie within the play of their gears
        self._frozen: dict[str, float] = {}
        self.walker: Final = _walker_of(body, self.clock)
        self._driven: Mapping[str, float] = {}
        angles = body.complete(posture or body.resting_angles)
        super().__init__(body.title or body.name, body.joints, self.clock, angles, body.couplings)
        self.gains: Final = self if body.gains else None
        self._camera_failure = camera_failure
        self.cameras: Final = body.cameras
        self.mechanisms: Final = tuple(
            FakeDevice(
                name,
                tuple(JointFacts(name + axis, *limits) for axis, *limits in _BALL_JOINTS),
                self.clock,
                {f"{name}Pan": 0.3 * (index - 0.5), f"{name}Distance": 1.0, f"{name}Height": 0.5},
            )
            for index, name in enumerate(_COLORS)
        )
        self.faults.watchers.append(self._note_failures)
        now, fails = self.clock.now, self.faults.of
        self.lights: Final = (
            FadingLights(now, body.lights, partial(fails, LEDS, "dark")) if body.lights else None
        )
        self.voice: Final = TimedVoice(now, partial(fails, SPEECH, "silent")) if body.voice else None
        self.loudspeaker: Final = TimedSounds(now, partial(fails, SOUNDS, "silent")) if body.voice else None
        self.senses = FakeSenses(self.clock, body, self._failing)
        self.eyes: Final = FailingEyes(FakeEyes(self), self._failing) if body.cameras else None

    def _go_on(self) -> None:
        """Turn also the wheels that drive it."""
        super()._go_on()
        if self._closed:
            return
        self._stick()
        if not isinstance(self.walker, FakeDrive):
            return
        driven = self.walker.angles()
        for wheel, angle in driven.items():
            if wheel in self._motions:
                turned = angle - self._driven.get(wheel, 0.0)
                self._motions[wheel] = self._motions[wheel].turned(turned)
        self._driven = driven

    def _note_failures(self) -> None:
        """Let joints stick and encoders freeze where they are at this moment."""
        with self._lock:
            self._reading = self._read()

    def _stick(self) -> None:
        """Leave the joints where they are that are stuck, or whose motors are limp."""
        present = self.faults.current()
        failing = {part for part, kind in present if kind in {"stuck", "limp"}} if present else set()
        still = failing & self._motions.keys()
        self._stuck = {name: self._stuck.get(name, self._motions[name].position) for name in still}
        for name, position in self._stuck.items():
            self._motions[name] = self._motions[name]._replace(position=position)

    def _measured(self, reading: JointReading) -> JointReading:
        """Return what encoders and thermometers report that may fail."""
        if not (present := self.faults.current()):
            self._loose, self._frozen = {}, {}
            return reading
        names = self.body.joint_names
        angles, heat = list(reading.positions), list(reading.temperatures)
        loose, frozen = {}, {}
        for (part, kind), fault in present.items():
            if part not in self._motions:
                continue
            place = names.index(part)
            match kind:
                case "backlash":
                    half, driven = fault.amount / 2, angles[place]
                    lies = min(max(self._loose.get(part, driven), driven - half), driven + half)
                    loose[part] = angles[place] = lies
                case "offset":
                    angles[place] += fault.amount
                case "noisy":
                    angles[place] += fault.amount * float(self._random.standard_normal())
                case "hot":
                    heat[place] = fault.amount
                case "frozen":
                    frozen[part] = angles[place] = self._frozen.get(part, angles[place])
        self._loose, self._frozen = loose, frozen
        return replace(reading, positions=tuple(angles), temperatures=tuple(heat))

    def _command(self, commands: Mapping[str, tuple[float, float]]) -> None:
        """Move setpoints, but those of slow joints no faster than these can."""
        slow = {part: fault.amount for (part, kind), fault in self.faults.current().items() if kind == "slow"}
        most = {name: share * self._by_name[name].max_velocity for name, share in slow.items()}
        super()._command(
            {name: (to, min(speed, most.get(name, math.inf))) for name, (to, speed) in commands.items()}
        )

    def _read(self) -> JointReading:
        reading = self._measured(super()._read())
        if not isinstance(self.walker, FakeDrive):
            return reading
        speeds = self.walker.speeds()
        velocities = zip(self.body.joint_names, reading.velocities, strict=True)
        return replace(reading, velocities=tuple(value + speeds.get(name, 0.0) for name, value in velocities))

    def looks(self) -> str:
        return write_looks(self.body)

    def state(self) -> BodyState:
        """Return the state of a robot that stands upright: it cannot fall."""
        return BodyState(torso_tilt=0.0, fallen=False, real_time_factor=self.clock.rate, lag=0.0)

    def capture(self, camera: str, width: int, height: int) -> Frame:
        """Draw the view of a camera: each ball as a disc of its colour on a grey background."""
        facts = next((facts for facts in self.cameras if facts.name == camera), None)
        if facts is None:
            raise HardwareFailure(sentence(f"there is no camera {camera!r}"))
        if self._camera_failure is not None:
            raise HardwareFailure(self._camera_failure)
        if self._closed:
            raise HardwareFailure(f"{camera}: the robot is closed")
        return self._failing.frame(camera, (width, height), partial(self._view, facts, width, height))

    def _view(self, facts: Camera, width: int, height: int) -> Frame:
        reading = self.read()
        balls = [(Ball(*ball.read().positions), _COLORS[ball.name]) for ball in self.mechanisms]
        return view(self.body, facts, reading, (width, height), balls)

    def start(self) -> None:
        """Do nothing: the robot computes its state on request."""

    def close(self) -> None:
        super().close()
        if self.walker is not None:
            self.walker.close()
        for ball in self.mechanisms:
            ball.close()
