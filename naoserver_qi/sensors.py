"""ALSonar, and what ALMemory has under its keys: the newest readings of the robot's joints and senses."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Final

from naoserver.capabilities import FootReading, SenseReading, Senses
from naoserver.errors import HardwareFailure, InvalidCommand
from naoserver.robot import JointReading
from naoserver.walk_guard import WalkGuard
from naoserver_qi.access import Access
from naoserver_qi.arguments import text

__all__ = ["ALSonar", "Moment", "keys_of"]

GRAVITY: Final = 9.81
"""In m/s2: pressure is told in kg."""
NOTHING_NEAR: Final = 5.0
"""What the sonar tells in m when nothing is in its range."""
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


def keys_of(access: Access, sonar: ALSonar) -> Mapping[str, Look]:
    """Return what tells the value of every key that the robot keeps itself."""
    keys: dict[str, Look] = dict(_of_joints(access))
    keys["RobotConfig/Body/Type"] = lambda _moment: "nao"
    keys["RobotConfig/Body/BaseVersion"] = lambda _moment: "V6.0"
    keys["RobotConfig/Head/BaseVersion"] = lambda _moment: "V6.0"
    keys["DCM/Time"] = lambda moment: round(moment.joints.time * 1000)
    keys["robotHasFallen"] = lambda moment: moment.fallen
    keys["robotIsWakeUp"] = lambda moment: min(moment.joints.stiffnesses) > 0.0
    if access.robot.senses is not None:
        keys.update(_of_inertial_unit(access))
        keys.update(_of_feet())
        keys.update(_of_sonar(sonar))
        keys.update(_of_battery())
        keys.update(_of_touch(access.robot.senses.touch_names))
    return keys


def _of_joints(access: Access) -> Iterator[tuple[str, Look]]:
    for i, joint in enumerate(access.body.joints):
        device = f"{_DEVICES}{joint.name}/"
        yield f"{device}Position/Sensor/Value", _entry(lambda moment: moment.joints.positions, i)
        yield f"{device}Position/Actuator/Value", _entry(lambda moment: moment.joints.commands, i)
        yield f"{device}Hardness/Actuator/Value", _entry(lambda moment: moment.joints.stiffnesses, i)
        yield f"{device}Temperature/Sensor/Value", _entry(lambda moment: moment.joints.temperatures, i)
        yield f"Motion/Velocity/Sensor/{joint.name}", _entry(lambda moment: moment.joints.velocities, i)
        yield f"Motion/Torque/Sensor/{joint.name}", _entry(lambda moment: moment.joints.torques, i)


def _of_inertial_unit(access: Access) -> Iterator[tuple[str, Look]]:
    unit = f"{_DEVICES}InertialSensor/"
    for i, axis in enumerate("XYZ"):
        acceleration = _pull(i)
        angular_velocity = _entry(lambda moment: moment.senses.inertial.angular_velocity, i)
        # The short names are those of the NAO4 and older, the long ones came with the NAO5.
        yield f"{unit}Acc{axis}/Sensor/Value", acceleration
        yield f"{unit}Accelerometer{axis}/Sensor/Value", acceleration
        yield f"{unit}Gyr{axis}/Sensor/Value", angular_velocity
        yield f"{unit}Gyroscope{axis}/Sensor/Value", angular_velocity
    yield f"{unit}AngleX/Sensor/Value", lambda moment: moment.senses.inertial.roll
    yield f"{unit}AngleY/Sensor/Value", lambda moment: moment.senses.inertial.pitch
    if access.walk is not None:
        yield f"{unit}AngleZ/Sensor/Value", _heading(access.walk)


def _of_feet() -> Iterator[tuple[str, Look]]:
    feet: dict[str, Callable[[Moment], FootReading]] = {
        "LFoot": lambda moment: moment.senses.left_foot,
        "RFoot": lambda moment: moment.senses.right_foot,
    }
    for foot, of in feet.items():
        pressure = f"{_DEVICES}{foot}/FSR/"
        yield f"{pressure}FrontLeft/Sensor/Value", _mass(of, lambda reading: reading.front_left)
        yield f"{pressure}FrontRight/Sensor/Value", _mass(of, lambda reading: reading.front_right)
        yield f"{pressure}RearLeft/Sensor/Value", _mass(of, lambda reading: reading.rear_left)
        yield f"{pressure}RearRight/Sensor/Value", _mass(of, lambda reading: reading.rear_right)
        yield f"{pressure}TotalWeight/Sensor/Value", _mass(of, lambda reading: reading.total)


def _of_sonar(sonar: ALSonar) -> Iterator[tuple[str, Look]]:
    for i, side in enumerate(("Left", "Right")):
        yield f"{_DEVICES}US/{side}/Sensor/Value", _distance(sonar, i)


def _distance(sonar: ALSonar, side: int) -> Look:
    return lambda _moment: min(sonar._distances()[side], NOTHING_NEAR)


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
            yield key, _pressed({name})
    for side, event in (("L", "LeftBumperPressed"), ("R", "RightBumperPressed")):
        yield event, _pressed({name for name in names if name.startswith(f"{side}FootBumper")})


def _heading(walk: WalkGuard) -> Look:
    return lambda _moment: walk.read().heading


def _entry(of: Callable[[Moment], Sequence[float]], index: int) -> Look:
    return lambda moment: of(moment)[index]


def _pull(axis: int) -> Look:
    """Return what tells how gravity and inertia pull: a NAO6 tells -9.8 m/s2 along z where it stands."""
    return lambda moment: -moment.senses.inertial.acceleration[axis]


def _mass(of: Callable[[Moment], FootReading], force: Callable[[FootReading], float]) -> Look:
    return lambda moment: force(of(moment)) / GRAVITY


def _pressed(sensors: set[str]) -> Look:
    return lambda moment: 0.0 if sensors.isdisjoint(moment.senses.touched) else 1.0


def _touch_keys(name: str) -> Iterator[str]:
    """Yield the keys of a touch sensor: of its device, and of what ALTouch tells of it."""
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
