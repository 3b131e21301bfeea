"""Keys of ALMemory: those of joints and senses, as a robot spells them, and their units."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from naoserver._naoqi_names import AXES, DEVICES, GRAVITY, JOINT_KEYS, touch_key
from naoserver.body import Body
from naoserver.capabilities import (
    BatteryReading,
    FootReading,
    InertialReading,
    SenseReading,
    SonarReading,
    Vector,
)
from naoserver.parts import CORNERS
from naoserver.robot import JointReading

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


class MemoryLayout:
    """The keys to request, and the conversion of the answer.

    `known` are all keys that the robot has. Of several spellings, the first known one is used: those of the
    inertial unit changed with NAO5. Sensors that the robot lacks read as at rest: nothing pressed,
    nothing near; a charge that it does not report is NaN.
    The signs of the inertial unit are those of a NAO6, or of a Nao before it.
    Raises KeyError, naming it, for a joint that has no position.
    """

    def __init__(self, known: Collection[str], body: Body, *, nao6: bool = True) -> None:
        self.keys: Final[list[str]] = []
        known = frozenset(known)
        self._known = known
        self._body = body
        self._joints = {field: self._table(key) for field, key in JOINT_KEYS.items()}
        if None in self._joints["positions"]:
            raise KeyError(body.joint_names[self._joints["positions"].index(None)])
        unit = f"{DEVICES}InertialSensor/"
        self._acceleration_signs, self._turning_signs = _SIGNS_NAO6 if nao6 else _SIGNS_BEFORE
        self._acceleration = [self._add(f"{unit}{n}{a}/Sensor/Value" for n in _ACC) for a in AXES]
        self._angular_velocity = [self._add(f"{unit}{n}{a}/Sensor/Value" for n in _GYR) for a in AXES]
        self._roll, self._pitch = (self._add([f"{unit}Angle{axis}/Sensor/Value"]) for axis in "XY")
        self._feet = [
            [self._add([f"{DEVICES}{foot}/FSR/{corner}/Sensor/Value"]) for corner in CORNERS]
            for foot in ("LFoot", "RFoot")
        ]
        self._sonar = [self._add([f"{DEVICES}US/{side}/Sensor/Value"]) for side in ("Left", "Right")]
        self._touch = [(name, self._add([touch_key(name)])) for name in body.touch_sensors]
        battery = f"{DEVICES}Battery/"
        self._charge, self._current, self._temperature = (
            self._add([f"{battery}{part}/Sensor/Value"]) for part in ("Charge", "Current", "Temperature")
        )
        self._plugged = self._add(["BatteryPowerPluggedChanged"])

    def read(self, values: Sequence[Any], time: float) -> Measurements:
        """Return the measurements in the answer to `keys`, taken at `time` in s.

        Raises ValueError for a malformed answer, or a missing or impossible position of a joint.
        """
        if len(values) != len(self.keys):
            raise ValueError(f"{len(values)} values came for {len(self.keys)} keys")
        numbers = np.array([_number(value) for value in values], dtype=float)

        def at(index: int | None, otherwise: float = 0.0) -> float:
            value = otherwise if index is None else float(numbers[index])
            return otherwise if math.isnan(value) else value

        def vector(places: Sequence[int | None], signs: Vector, rest: float = 0.0) -> Vector:
            """Return three values, each with its sign; missing ones are 0, and `rest` along z."""
            entries = zip(places, signs, (0.0, 0.0, rest), strict=True)
            x, y, z = (sign * at(place, sign * otherwise) for place, sign, otherwise in entries)
            return x, y, z

        def joints(field: str, otherwise: float = 0.0) -> tuple[float, ...]:
            return tuple(at(index, otherwise) for index in self._joints[field])

        positions = joints("positions", math.nan)
        for joint, position in zip(self._body.joints, positions, strict=True):
            if math.isnan(position):
                raise ValueError(f"there is no position of {joint.name}")
            if not joint.lower - _STRAY <= position <= joint.upper + _STRAY:
                raise ValueError(f"{joint.name} is at {position:g}, out of its range")
        commands = zip(self._joints["commands"], positions, strict=True)
        left, right = (FootReading(*(max(0.0, GRAVITY * at(i)) for i in foot)) for foot in self._feet)
        charge, current = at(self._charge, math.nan), at(self._current)
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
                    acceleration=vector(self._acceleration, self._acceleration_signs, rest=GRAVITY),
                    angular_velocity=vector(self._angular_velocity, self._turning_signs),
                    roll=at(self._roll),
                    pitch=at(self._pitch),
                ),
                left_foot=left,
                right_foot=right,
                sonar=SonarReading(
                    *(at(index) if 0.0 < at(index) <= FARTHEST_ECHO else math.inf for index in self._sonar)
                ),
                touched=frozenset(name for name, index in self._touch if at(index) > _PRESSED),
                battery=BatteryReading(
                    charge=charge,
                    current=current,
                    temperature=at(self._temperature),
                    plugged=bool(at(self._plugged, float(current > 0.0))),
                ),
            ),
        )

    def _add(self, spellings: Sequence[str] | Iterator[str]) -> int | None:
        """Request the first key that the robot knows; return its place in the answer, None without one."""
        for key in spellings:
            if key in self._known:
                self.keys.append(key)
                return len(self.keys) - 1
        return None

    def _table(self, key: str) -> list[int | None]:
        """Request a value of each joint; a joint that shares a motor may have its leader's value."""
        leaders = {pair.follower: pair.leader for pair in self._body.couplings}
        return [
            self._add(key.format(name) for name in (joint, leaders.get(joint, joint)))
            for joint in self._body.joint_names
        ]


_ACC: Final = ("Accelerometer", "Acc")
_GYR: Final = ("Gyroscope", "Gyr")

# Convert the robot's values to specific force and turning rate, x forward, y left, z up: a standing robot
# reports -9.8 along z. All RoboCup code that ran on both does the same, such as the providers of Nao Devils;
# the sample of a NAO6's values in the tests of ros-sports/nao_lola, which leans backwards by 0.36 rad,
# agrees.
_SIGNS_NAO6: Final = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
_SIGNS_BEFORE: Final = ((-1.0, 1.0, -1.0), (1.0, 1.0, -1.0))


def _number(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) and math.isfinite(value) else math.nan
