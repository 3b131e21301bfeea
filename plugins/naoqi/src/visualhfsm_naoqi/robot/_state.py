"""Measurements of the robot, by one call per cycle, and its setpoints between NAOqi's reports of them.

The call asks for keys of ALMemory: those of joints and senses, as a robot spells them.
"""

from __future__ import annotations

import logging
import math
import threading
from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Final, NamedTuple, TypeAlias

from naoserver.bodies.body import Body
from naoserver.bodies.capabilities import (
    BatteryReading,
    FootReading,
    InertialReading,
    SenseReading,
    SonarReading,
    Vector,
)
from naoserver.bodies.parts import CORNERS, LYING_TILT, JointFacts
from naoserver.errors import HardwareFailure
from naoserver.hardware.connection import CallFailed, HardwareLimits
from naoserver.protocol.robot import BodyState, JointReading
from visualhfsm_naoqi._names import AXES, DEVICES, GRAVITY, JOINT_KEYS, touch_key
from visualhfsm_naoqi.robot._link import NAME, is_nao6
from visualhfsm_naoqi.robot.calls import CallLink, call
from zenoh_ice import Clock

FARTHEST_ECHO: Final = 2.55
"""Range in m: a sonar reading beyond it means that nothing is near; so does 0, before the first echo."""
_COMFORTABLE: Final = 25.0
"""Temperature in degrees Celsius of a motor that reports none."""
_PRESSED: Final = 0.5
_STRAY: Final = 0.5
"""Distance in rad from its range beyond which a joint cannot be: the measurement is wrong."""


class Measurements(NamedTuple):
    """Measurements of one moment, in SI units and radians."""

    joints: JointReading
    """In the order of the body; a velocity is nan if the robot reports none, as for hands."""
    senses: SenseReading


Spellings: TypeAlias = tuple[str, ...]
"""The keys of a value in ALMemory, of which a robot has one: those of the inertial unit changed with NAO5."""


def _of_device(*names: str) -> Spellings:
    return tuple(f"{DEVICES}{name}/Sensor/Value" for name in names)


_UNIT: Final = "InertialSensor/"
_ACCELERATION: Final = [_of_device(f"{_UNIT}Accelerometer{axis}", f"{_UNIT}Acc{axis}") for axis in AXES]
_TURNING: Final = [_of_device(f"{_UNIT}Gyroscope{axis}", f"{_UNIT}Gyr{axis}") for axis in AXES]
_ROLL, _PITCH = (_of_device(f"{_UNIT}Angle{axis}") for axis in "XY")
_FEET: Final = [[_of_device(f"{foot}/FSR/{corner}") for corner in CORNERS] for foot in ("LFoot", "RFoot")]
_SONAR: Final = [_of_device(f"US/{side}") for side in ("Left", "Right")]
_CHARGE, _CURRENT, _WARMTH = (_of_device(f"Battery/{part}") for part in ("Charge", "Current", "Temperature"))
_PLUGGED: Final = ("BatteryPowerPluggedChanged",)
_OF_SENSES: Final = (*_ACCELERATION, *_TURNING, _ROLL, _PITCH, *_FEET[0], *_FEET[1], *_SONAR)
_OF_BATTERY: Final = (_CHARGE, _CURRENT, _WARMTH, _PLUGGED)


class MemoryLayout:
    """The keys to request, and the conversion of the answer.

    `known` are all keys that the robot has. Sensors that the robot lacks read as at rest: nothing pressed,
    nothing near; a charge that it does not report is NaN.
    The signs of the inertial unit are those of a NAO6, or of a Nao before it.
    Raises KeyError, naming it, for a joint that has no position.
    """

    def __init__(self, known: Collection[str], body: Body, *, nao6: bool = True) -> None:
        self._body = body
        self._signs = _SIGNS_NAO6 if nao6 else _SIGNS_BEFORE
        self._touch = {name: (touch_key(name),) for name in body.touch_sensors}
        # A joint that shares a motor may have its leader's value.
        leaders = {pair.follower: pair.leader for pair in body.couplings}
        names = [(joint, leaders.get(joint, joint)) for joint in body.joint_names]
        self._joints: dict[str, list[Spellings]] = {
            field: [(key.format(own), key.format(leader)) for own, leader in names]
            for field, key in JOINT_KEYS.items()
        }
        wanted = (*chain(*self._joints.values()), *_OF_SENSES, *self._touch.values(), *_OF_BATTERY)
        known = frozenset(known)
        self.keys: Final = [key for key in dict.fromkeys(chain(*wanted)) if key in known]
        for joint, keys in zip(body.joint_names, self._joints["positions"], strict=True):
            if known.isdisjoint(keys):
                raise KeyError(joint)

    def read(self, values: Sequence[Any], time: float) -> Measurements:
        """Return the measurements in the answer to `keys`, taken at `time` in s.

        Raises ValueError for a malformed answer, or a missing or impossible position of a joint.
        """
        if len(values) != len(self.keys):
            raise ValueError(f"{len(values)} values came for {len(self.keys)} keys")
        numbers = dict(zip(self.keys, map(_number, values), strict=True))

        def at(keys: Spellings, otherwise: float = 0.0) -> float:
            for key in keys:
                if key in numbers:
                    return otherwise if math.isnan(numbers[key]) else numbers[key]
            return otherwise

        def vector(parts: Sequence[Spellings], signs: Vector, rest: float = 0.0) -> Vector:
            """Return three values, each with its sign; missing ones are 0, and `rest` along z."""
            entries = zip(parts, signs, (0.0, 0.0, rest), strict=True)
            x, y, z = (sign * at(keys, sign * otherwise) for keys, sign, otherwise in entries)
            return x, y, z

        def joints(field: str, otherwise: float = 0.0) -> tuple[float, ...]:
            return tuple(at(keys, otherwise) for keys in self._joints[field])

        positions = joints("positions", math.nan)
        for joint, position in zip(self._body.joints, positions, strict=True):
            if math.isnan(position):
                raise ValueError(f"there is no position of {joint.name}")
            if not joint.lower - _STRAY <= position <= joint.upper + _STRAY:
                raise ValueError(f"{joint.name} is at {position:g}, out of its range")
        commands = zip(self._joints["commands"], positions, strict=True)
        left, right = (FootReading(*(max(0.0, GRAVITY * at(i)) for i in foot)) for foot in _FEET)
        charge, current = at(_CHARGE, math.nan), at(_CURRENT)
        acceleration_signs, turning_signs = self._signs
        return Measurements(
            joints=JointReading(
                time=time,
                positions=positions,
                velocities=joints("velocities", math.nan),
                commands=tuple(at(index, position) for index, position in commands),
                torques=joints("torques"),
                stiffnesses=tuple(min(1.0, max(0.0, stiffness)) for stiffness in joints("stiffnesses")),
                temperatures=joints("temperatures", _COMFORTABLE),
            ),
            senses=SenseReading(
                time=time,
                inertial=InertialReading(
                    acceleration=vector(_ACCELERATION, acceleration_signs, rest=GRAVITY),
                    angular_velocity=vector(_TURNING, turning_signs),
                    roll=at(_ROLL),
                    pitch=at(_PITCH),
                ),
                left_foot=left,
                right_foot=right,
                sonar=SonarReading(
                    *(at(index) if 0.0 < at(index) <= FARTHEST_ECHO else math.inf for index in _SONAR)
                ),
                touched=frozenset(name for name, keys in self._touch.items() if at(keys) > _PRESSED),
                battery=BatteryReading(
                    charge=charge,
                    current=current,
                    temperature=at(_WARMTH),
                    plugged=bool(at(_PLUGGED, float(current > 0.0))),
                ),
            ),
        )


# Convert the robot's values to specific force and turning rate, x forward, y left, z up: a standing robot
# reports -9.8 along z. All RoboCup code that ran on both does the same, such as the providers of Nao Devils;
# the sample of a NAO6's values in the tests of ros-sports/nao_lola, which leans backwards by 0.36 rad,
# agrees.
_SIGNS_NAO6: Final = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
_SIGNS_BEFORE: Final = ((-1.0, 1.0, -1.0), (1.0, 1.0, -1.0))


def _number(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) and math.isfinite(value) else math.nan


_logger = logging.getLogger(__name__)

_WINDOW: Final = 4
"""Measurements for a velocity that the robot does not report: its cycle and ours drift."""
_LISTING: Final = 5.0
"""Seconds for the robot to list its keys, some thousands."""
_REPORT: Final = 0.2
"""Seconds after which NAOqi's report shows a command."""
_SLACK: Final = 0.05
"""Distance in rad by which a setpoint may differ from its report in addition to the effect of the delay."""


@dataclass(frozen=True, slots=True)
class _Way:
    """The course of a setpoint from `time` on: it moves at `rate` until it is at `end`."""

    time: float
    value: float
    rate: float
    end: float

    def at(self, time: float) -> float:
        if self.rate == 0.0:
            return self.value
        value = self.value + self.rate * max(0.0, time - self.time)
        return min(value, self.end) if self.rate > 0.0 else max(value, self.end)

    @property
    def arrival(self) -> float:
        return self.time + (abs((self.end - self.value) / self.rate) if self.rate else 0.0)


class Setpoints:
    """The setpoint of each joint, computed from the commands and corrected by NAOqi's reports.

    A report is some hundredths of a second old, too old to plan the next step from where a
    setpoint is. While a joint follows a command, the model counts, unless the report shows that
    something else moves the joint; otherwise the report counts. Callers serialise the calls.
    """

    def __init__(self, joints: Sequence[JointFacts]) -> None:
        self._joints = {joint.name: joint for joint in joints}
        self._ways = {joint.name: _Way(-math.inf, 0.0, 0.0, 0.0) for joint in joints}
        self._limp = frozenset[str]()  # according to the newest report

    def at(self, time: float) -> tuple[float, ...]:
        """Return every setpoint at a time in s."""
        return tuple(way.at(time) for way in self._ways.values())

    def send(self, joint: str, target: float, speed: float, time: float) -> bool:
        """Move a setpoint to a target at a speed; return False if it already rests there.

        That of a limp motor stays with its joint.
        """
        if joint in self._limp:
            return True
        facts, value = self._joints[joint], self._ways[joint].at(time)
        if value == target and not self.moving(joint, time):
            return False
        end = min(max(target, facts.lower), facts.upper)
        self._ways[joint] = _Way(time, value, math.copysign(speed, end - value) if end != value else 0.0, end)
        return True

    def moving(self, joint: str, time: float) -> bool:
        """Return whether a setpoint is on its way."""
        way = self._ways[joint]
        return way.rate != 0.0 and time < way.arrival

    def hold(self, joint: str, time: float) -> None:
        """Keep a setpoint where it is."""
        value = self._ways[joint].at(time)
        self._ways[joint] = _Way(time, value, 0.0, value)

    def report(
        self,
        commands: Sequence[float],
        positions: Sequence[float],
        stiffnesses: Sequence[float],
        asked: float,
        answered: float,
    ) -> None:
        """Take NAOqi's report of every joint, which it made at some time between two in s.

        The setpoint of a limp motor follows its joint.
        """
        reports = [*zip(self._ways, commands, positions, stiffnesses, strict=True)]
        self._limp = frozenset(joint for joint, _, _, stiffness in reports if stiffness == 0.0)
        for joint, command, position, stiffness in reports:
            if stiffness == 0.0:
                self._ways[joint] = _Way(-math.inf, position, 0.0, position)
                continue
            way = self._ways[joint]
            if asked > way.arrival + _REPORT:
                if command != way.at(asked) or way.rate:
                    self._ways[joint] = _Way(-math.inf, command, 0.0, command)
            elif asked > way.time + _REPORT:
                low, high = sorted((way.at(asked), way.at(answered)))
                if max(low - command, command - high) > _SLACK + abs(way.rate) * _REPORT:
                    self._ways[joint] = replace(way, time=answered, value=command)  # something else moved it


class NaoqiState:
    """The newest measurements of a robot, and its setpoints."""

    def __init__(self, clock: Clock, facts: Body, limits: HardwareLimits) -> None:
        self.facts: Final = facts
        """The facts of its body."""
        self._clock = clock
        self._limits = limits
        self._layout: MemoryLayout | None = None
        self._setpoints = Setpoints(facts.joints)
        self._lock = threading.Lock()  # of setpoints; held for microseconds
        self._history: deque[tuple[float, tuple[float, ...]]] = deque(maxlen=_WINDOW)
        self._newest: Measurements | None = None  # replaced as a whole
        self._frozen: float | None = None

    def open(self, link: CallLink) -> None:
        """Find out which keys the robot has. Raises HardwareFailure when it has another body."""
        known = call(link, "ALMemory.getDataListName", timeout=_LISTING)
        nao6 = is_nao6(link)
        try:
            self._layout = MemoryLayout(known, self.facts, nao6=nao6)
        except KeyError as error:
            try:
                kind = str(call(link, "ALMemory.getData", "RobotConfig/Body/Type"))[:40]
            except HardwareFailure:
                kind = "robot of unknown kind"
            lacks = f"the robot, a {kind}, has no joint {error.args[0]}"
            message = f"{lacks}, as a Nao {self.facts.name} has; --body names another body"
            raise HardwareFailure(message) from None
        self._history.clear()
        self._frozen = None

    def tick(self, link: CallLink) -> None:
        """Measure. Raises CallFailed, CallTimeout or LinkLost."""
        layout = self._layout
        assert layout is not None
        asked = self._clock.now()
        values = call(link, "ALMemory.getListData", layout.keys, timeout=self._limits.silence)
        answered = self._clock.now()
        try:
            measured = layout.read(values, asked)  # no earlier: who waits for a time sees what came after it
        except (TypeError, ValueError) as error:
            raise CallFailed(f"ALMemory.getListData: {error}") from None
        joints = measured.joints
        self._history.append((asked, joints.positions))
        first, positions = self._history[0]
        passed = asked - first

        def measured_velocity(velocity: float, now: float, before: float) -> float:
            if not math.isnan(velocity):
                return velocity
            return (now - before) / passed if passed > 0.0 else 0.0

        velocities = tuple(map(measured_velocity, joints.velocities, joints.positions, positions))
        with self._lock:
            self._setpoints.report(joints.commands, joints.positions, joints.stiffnesses, asked, answered)
        self._newest = measured._replace(joints=replace(joints, velocities=velocities))

    def freeze(self) -> None:
        """Keep setpoints where they are from now on: the robot is lost."""
        self._frozen = self._clock.now()

    def joints(self) -> JointReading:
        """Return the newest reading of the joints; the setpoints are those of this moment."""
        # The reading first: its time is never after that of its setpoints.
        newest, now = self._require().joints, self._now()
        with self._lock:
            commands = self._setpoints.at(now)
        return replace(newest, commands=commands)

    def send(self, ways: Mapping[str, tuple[float, float]]) -> list[str]:
        """Move setpoints to targets at speeds from now on, by joint; return the joints that this changes."""
        with self._lock:
            now = self._now()
            return [joint for joint, way in ways.items() if self._setpoints.send(joint, *way, now)]

    def hold(self, joints: Iterable[str]) -> None:
        """Keep setpoints where they are now."""
        with self._lock:
            now = self._now()
            for joint in joints:
                self._setpoints.hold(joint, now)

    def senses(self) -> SenseReading:
        """Return the newest reading of the senses."""
        return self._require().senses

    def body(self) -> BodyState:
        """Return the state of the body, according to the inertial unit."""
        tilt = self.senses().inertial.tilt
        factor = 1.0 if self._frozen is None else 0.0
        return BodyState(torso_tilt=tilt, fallen=tilt > LYING_TILT, real_time_factor=factor, lag=0.0)

    def _now(self) -> float:
        return self._clock.now() if self._frozen is None else self._frozen

    def _require(self) -> Measurements:
        if self._newest is None:
            raise HardwareFailure("the robot has not been asked yet: start it first")
        return self._newest


class NaoqiSenses:
    """The senses of the robot, with the sonar on while they are open. Implements Senses."""

    sonar_cone = math.radians(60.0)

    def __init__(self, state: NaoqiState) -> None:
        self.touch_names: Final = state.facts.touch_sensors
        self.read: Final = state.senses
        self._sonar = False

    @property
    def sonar_range(self) -> tuple[float, float] | None:
        return (0.25, FARTHEST_ECHO) if self._sonar else None

    def inertial(self) -> InertialReading:
        return self.read().inertial

    def open(self, link: CallLink) -> None:
        """Turn the sonar on, if the robot has one."""
        self._sonar = False
        try:
            call(link, "ALSonar.subscribe", NAME)
            self._sonar = True
        except CallFailed as error:
            _logger.info("the sonar stays off: %s", error)

    def close(self, link: CallLink | None) -> None:
        """Turn the sonar off, unless another program uses it."""
        try:
            if link is not None:
                call(link, "ALSonar.unsubscribe", NAME, timeout=1.0)
        except HardwareFailure as error:
            _logger.debug("the sonar stays as it is: %s", error)
