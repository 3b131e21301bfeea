"""The keys of ALMemory under which the robot keeps its readings, and how each is looked up."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from operator import attrgetter
from typing import Any, Final

from naoserver.capabilities import SenseReading
from naoserver.naoqi_names import AXES, DEVICES, GRAVITY, JOINT_KEYS, touch_key
from naoserver.robot import JointReading
from naoserver_qi.access import Access
from naoserver_qi.postures import ALRobotPosture

TOUCH: Final = "TouchChanged"
"""The event of all touch sensors; its value is what they feel."""
NOTHING_NEAR: Final = 5.0
"""Distance in m of the sonar when nothing is in its range."""
_FULL: Final = 0.99
"""Charge of a battery that counts as full."""
_STANDS: Final = 1.0
"""Mass in kg on a foot that touches the ground."""


class Moment:
    """The readings of one moment, each taken when it is first asked for."""

    def __init__(self, access: Access) -> None:
        self._access = access

    @cached_property
    def joints(self) -> JointReading:
        """The joints."""
        return self._access.body.read()

    @cached_property
    def senses(self) -> SenseReading:
        """The other senses."""
        senses = self._access.robot.senses
        assert senses is not None  # since there are keys of them
        return senses.read()

    @cached_property
    def fallen(self) -> bool:
        """Whether the robot has fallen."""
        return self._access.robot.state().fallen


Look = Callable[[Moment], Any]
Distances = Callable[[], tuple[float, float]]
"""What the sonar measures to the left and to the right, in m."""

_FOOT_KEYS: Final = {
    "FrontLeft": "front_left",
    "FrontRight": "front_right",
    "RearLeft": "rear_left",
    "RearRight": "rear_right",
    "TotalWeight": "total",
}
"""The part of a FootReading under each key of a foot."""


def keys_of(access: Access, distances: Distances) -> Mapping[str, Look]:
    """Return how to look up every key that the robot keeps itself."""
    keys: dict[str, Look] = {
        "RobotConfig/Body/Type": lambda _: "nao",
        "RobotConfig/Body/BaseVersion": lambda _: "V6.0",
        "RobotConfig/Head/BaseVersion": lambda _: "V6.0",
        "DCM/Time": lambda moment: round(moment.joints.time * 1000),
        "robotHasFallen": attrgetter("fallen"),
        "robotIsWakeUp": lambda moment: min(moment.joints.stiffnesses) > 0.0,
    }
    postures = ALRobotPosture(access)
    keys["PostureChanged"] = lambda _: postures.getPosture()
    keys["PostureFamilyChanged"] = lambda _: postures.getPostureFamily()
    for i, joint in enumerate(access.body.joints):
        for part, key in JOINT_KEYS.items():
            keys[key.format(joint.name)] = partial(_entry, attrgetter(f"joints.{part}"), i, 1.0)
    if (senses := access.robot.senses) is not None:
        keys.update(_keys_of_senses(distances, senses.touch_names))
        if (walk := access.walk) is not None:
            keys[f"{DEVICES}InertialSensor/AngleZ/Sensor/Value"] = lambda _: walk.read().heading
    return keys


def _keys_of_senses(distances: Distances, touch_names: tuple[str, ...]) -> Iterator[tuple[str, Look]]:
    unit, battery = f"{DEVICES}InertialSensor/", f"{DEVICES}Battery/"
    pull, turning = attrgetter("senses.inertial.acceleration"), attrgetter("senses.inertial.angular_velocity")
    for i, axis in enumerate(AXES):
        # The short names are those of the NAO4 and older, the long ones came with the NAO5.
        for name in ("Acc", "Accelerometer"):  # gravity and inertia: -9.8 m/s2 along z of a NAO6 that stands
            yield f"{unit}{name}{axis}/Sensor/Value", partial(_entry, pull, i, -1.0)
        for name in ("Gyr", "Gyroscope"):
            yield f"{unit}{name}{axis}/Sensor/Value", partial(_entry, turning, i, 1.0)
    yield f"{unit}AngleX/Sensor/Value", attrgetter("senses.inertial.roll")
    yield f"{unit}AngleY/Sensor/Value", attrgetter("senses.inertial.pitch")
    contacts: list[Callable[[Moment], float]] = []
    for foot, side in (("LFoot", "left_foot"), ("RFoot", "right_foot")):
        for name, part in _FOOT_KEYS.items():
            yield (
                f"{DEVICES}{foot}/FSR/{name}/Sensor/Value",
                partial(_mass, attrgetter(f"senses.{side}.{part}")),
            )
        mass = partial(_mass, attrgetter(f"senses.{side}.total"))
        name = side.removesuffix("_foot")
        yield f"{name}FootTotalWeight", mass
        yield f"{name}FootContact", partial(_stands, (mass,))
        contacts.append(mass)
    for name in ("footContact", "footContactChanged"):
        yield name, partial(_stands, tuple(contacts))
    yield f"{DEVICES}US/Actuator/Value", lambda _: 0.0
    for i, side in enumerate(("Left", "Right")):
        yield f"{DEVICES}US/{side}/Sensor/Value", partial(_distance, distances, i)
    for part in ("Charge", "Current", "Temperature"):
        yield f"{battery}{part}/Sensor/Value", attrgetter(f"senses.battery.{part.lower()}")
    yield "BatteryChargeChanged", lambda moment: round(100 * moment.senses.battery.charge)
    yield "BatteryPowerPluggedChanged", attrgetter("senses.battery.plugged")
    yield "BatteryFullChargedFlagChanged", lambda moment: moment.senses.battery.charge >= _FULL
    for name in touch_names:
        yield touch_key(name), partial(_pressed, {name})
        if event := _touch_event(name):
            yield event, partial(_pressed, {name})
    yield TOUCH, partial(_touches, touch_names)
    for side in ("Left", "Right"):
        bumpers = {name for name in touch_names if name.startswith(f"{side[0]}FootBumper")}
        yield f"{side}BumperPressed", partial(_pressed, bumpers)


def _entry(values: Callable[[Moment], Sequence[float]], index: int, sign: float, moment: Moment) -> float:
    return sign * values(moment)[index]


def _mass(force: Callable[[Moment], float], moment: Moment) -> float:
    return force(moment) / GRAVITY


def _distance(distances: Distances, side: int, _moment: Moment) -> float:
    return min(distances()[side], NOTHING_NEAR)


def _stands(masses: tuple[Callable[[Moment], float], ...], moment: Moment) -> float:
    return 1.0 if any(mass(moment) > _STANDS for mass in masses) else 0.0


def _pressed(sensors: set[str], moment: Moment) -> float:
    return 0.0 if sensors.isdisjoint(moment.senses.touched) else 1.0


def _touches(names: tuple[str, ...], moment: Moment) -> list[list[object]]:
    touched = moment.senses.touched
    return [[touch_part(name), name in touched] for name in names]


def touch_part(name: str) -> str:
    """Return what NAOqi calls a touch sensor, such as `Head/Touch/Front`."""
    return touch_key(name).removeprefix(DEVICES).removesuffix("/Sensor/Value")


def _touch_event(name: str) -> str | None:
    """Return the event of a touch sensor; None of a bumper, since one event is of both of a foot."""
    if name == "ChestButton":
        return "ChestButtonPressed"
    if name.startswith("Head"):
        return f"{name.removeprefix('Head')}TactilTouched"
    if name[1:].startswith("Hand"):
        return f"Hand{'Left' if name[0] == 'L' else 'Right'}{name[5:]}Touched"
    return None
