"""ALSonar, and what ALMemory has under its keys: the newest readings of the robot's joints and senses."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial
from typing import Final

from naoserver.capabilities import SenseReading, Senses
from naoserver.errors import HardwareFailure, InvalidCommand
from naoserver.robot import JointReading
from naoserver_qi.access import Access
from naoserver_qi.arguments import text

__all__ = ["ALSonar", "Moment", "keys_of"]

GRAVITY: Final = 9.81
"""In m/s2: pressure is in kg."""
NOTHING_NEAR: Final = 5.0
"""Distance in m of the sonar when nothing is in its range."""
_FULL: Final = 0.99
_MOST: Final = 100
_DEVICES: Final = "Device/SubDeviceList/"


class ALSonar:
    """Turn the sonar on and off; ALMemory shows its newest reading while somebody has subscribed."""

    def __init__(self, senses: Senses | None) -> None:
        """Serve the sonar of some senses; None of a robot that has none."""
        self._senses = senses
        self._lock = threading.Lock()
        self._subscribers: dict[str, tuple[object, object]] = {}  # period and precision, without effect
        self._newest = (0.0, 0.0)

    def subscribe(self, name: object, period: object = 100, precision: object = 0.0) -> None:
        """Turn the sonar on for a subscriber."""
        if self._senses is None:
            raise HardwareFailure("this robot has no sonar")
        with self._lock:
            if len(self._subscribers) >= _MOST:
                raise InvalidCommand("name", f"the sonar has {_MOST} subscribers already")
            self._subscribers[text(name, "name")] = (period, precision)

    def unsubscribe(self, name: object) -> None:
        """Turn the sonar off for a subscriber; it is off when none is left."""
        self._distances()
        with self._lock:
            if self._subscribers.pop(text(name, "name"), None) is None:
                raise InvalidCommand("name", f"{str(name)[:60]!r} has not subscribed")

    def getSubscribersInfo(self) -> list[list[object]]:
        """Return name, period and precision of each subscriber."""
        with self._lock:
            return [[name, *wanted] for name, wanted in self._subscribers.items()]

    def _distances(self) -> tuple[float, float]:
        """Return the distances to the left and to the right in m; both 0 before anybody subscribed."""
        if self._subscribers and self._senses is not None:
            reading = self._senses.read().sonar
            self._newest = (reading.left, reading.right)
        return self._newest


class Moment:
    """The readings of one moment, each taken when it is first asked for."""

    def __init__(self, access: Access) -> None:
        self._access = access

    @cached_property
    def joints(self) -> JointReading:
        """The newest reading of the joints."""
        return self._access.body.read()

    @cached_property
    def senses(self) -> SenseReading:
        """The newest reading of the senses, which the robot has when there are keys of them."""
        senses = self._access.robot.senses
        assert senses is not None
        return senses.read()

    @cached_property
    def fallen(self) -> bool:
        """Whether the robot lies on the floor."""
        return self._access.robot.state().fallen


Look = Callable[[Moment], object]

_JOINT_KEYS: Final = {
    f"{_DEVICES}{{}}/Position/Sensor/Value": "positions",
    f"{_DEVICES}{{}}/Position/Actuator/Value": "commands",
    f"{_DEVICES}{{}}/Hardness/Actuator/Value": "stiffnesses",
    f"{_DEVICES}{{}}/Temperature/Sensor/Value": "temperatures",
    "Motion/Velocity/Sensor/{}": "velocities",
    "Motion/Torque/Sensor/{}": "torques",
}
"""The part of a JointReading under each key of a joint."""
_FOOT_KEYS: Final = {
    "FrontLeft": "front_left",
    "FrontRight": "front_right",
    "RearLeft": "rear_left",
    "RearRight": "rear_right",
    "TotalWeight": "total",
}
"""The part of a FootReading under each key of a foot."""


def keys_of(access: Access, sonar: ALSonar) -> Mapping[str, Look]:
    """Return how to look up every key that the robot keeps itself."""
    keys: dict[str, Look] = {
        "RobotConfig/Body/Type": lambda _: "nao",
        "RobotConfig/Body/BaseVersion": lambda _: "V6.0",
        "RobotConfig/Head/BaseVersion": lambda _: "V6.0",
        "DCM/Time": lambda moment: round(moment.joints.time * 1000),
        "robotHasFallen": lambda moment: moment.fallen,
        "robotIsWakeUp": lambda moment: min(moment.joints.stiffnesses) > 0.0,
    }
    for i, joint in enumerate(access.body.joints):
        for key, part in _JOINT_KEYS.items():
            keys[key.format(joint.name)] = partial(_of_joint, part, i)
    if access.robot.senses is not None:
        keys.update(_of_inertial_unit(access))
        for foot, side in (("LFoot", "left_foot"), ("RFoot", "right_foot")):
            for name, part in _FOOT_KEYS.items():
                keys[f"{_DEVICES}{foot}/FSR/{name}/Sensor/Value"] = partial(_of_foot, side, part)
        for i, side in enumerate(("Left", "Right")):
            keys[f"{_DEVICES}US/{side}/Sensor/Value"] = partial(_of_sonar, sonar, i)
        keys.update(_of_battery())
        keys.update(_of_touch(access.robot.senses.touch_names))
    return keys


def _of_joint(part: str, index: int, moment: Moment) -> float:
    value: float = getattr(moment.joints, part)[index]
    return value


def _of_foot(side: str, part: str, moment: Moment) -> float:
    force: float = getattr(getattr(moment.senses, side), part)
    return force / GRAVITY


def _of_sonar(sonar: ALSonar, side: int, _moment: Moment) -> float:
    return min(sonar._distances()[side], NOTHING_NEAR)


def _of_inertial_unit(access: Access) -> Iterator[tuple[str, Look]]:
    unit = f"{_DEVICES}InertialSensor/"
    for i, axis in enumerate("XYZ"):
        # The short names are those of the NAO4 and older, the long ones came with the NAO5.
        for name in ("Acc", "Accelerometer"):
            yield f"{unit}{name}{axis}/Sensor/Value", partial(_pull, i)
        for name in ("Gyr", "Gyroscope"):
            yield f"{unit}{name}{axis}/Sensor/Value", partial(_turning, i)
    yield f"{unit}AngleX/Sensor/Value", lambda moment: moment.senses.inertial.roll
    yield f"{unit}AngleY/Sensor/Value", lambda moment: moment.senses.inertial.pitch
    if (walk := access.walk) is not None:
        yield f"{unit}AngleZ/Sensor/Value", lambda _: walk.read().heading


def _pull(axis: int, moment: Moment) -> float:
    """Return the pull of gravity and inertia: -9.8 m/s2 along z of a NAO6 that stands."""
    return -moment.senses.inertial.acceleration[axis]


def _turning(axis: int, moment: Moment) -> float:
    return moment.senses.inertial.angular_velocity[axis]


def _of_battery() -> Iterator[tuple[str, Look]]:
    battery = f"{_DEVICES}Battery/"
    yield f"{battery}Charge/Sensor/Value", lambda moment: moment.senses.battery.charge
    yield f"{battery}Current/Sensor/Value", lambda moment: moment.senses.battery.current
    yield f"{battery}Temperature/Sensor/Value", lambda moment: moment.senses.battery.temperature
    yield "BatteryChargeChanged", lambda moment: round(100 * moment.senses.battery.charge)
    yield "BatteryPowerPluggedChanged", lambda moment: moment.senses.battery.plugged
    yield "BatteryFullChargedFlagChanged", lambda moment: moment.senses.battery.charge >= _FULL


def _of_touch(names: tuple[str, ...]) -> Iterator[tuple[str, Look]]:
    for name in names:
        for key in _touch_keys(name):
            yield key, partial(_pressed, {name})
    for side, event in (("L", "LeftBumperPressed"), ("R", "RightBumperPressed")):
        bumpers = {name for name in names if name.startswith(f"{side}FootBumper")}
        yield event, partial(_pressed, bumpers)


def _pressed(sensors: set[str], moment: Moment) -> float:
    return 0.0 if sensors.isdisjoint(moment.senses.touched) else 1.0


def _touch_keys(name: str) -> Iterator[str]:
    """Yield the keys of a touch sensor: of its device, and of its event."""
    if name == "ChestButton":
        yield f"{_DEVICES}ChestBoard/Button/Sensor/Value"
        yield "ChestButtonPressed"
    elif name.startswith("Head"):
        place = name.removeprefix("Head")
        yield f"{_DEVICES}Head/Touch/{place}/Sensor/Value"
        yield f"{place}TactilTouched"
    elif name[1:].startswith("Hand"):
        place = name[5:]
        side = "Left" if name[0] == "L" else "Right"
        yield f"{_DEVICES}{name[:5]}/Touch/{place}/Sensor/Value"
        yield f"Hand{side}{place}Touched"
    elif name[1:].startswith("FootBumper"):
        yield f"{_DEVICES}{name[:5]}/Bumper/{name[11:]}/Sensor/Value"
