"""Senses of the robot, its name and its body, and the keys of ALMemory that the robot itself keeps."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple
from operator import attrgetter
from typing import Any, Final

from naoserver.bodies.body import Body
from naoserver.bodies.capabilities import FootReading, SenseReading
from naoserver.bodies.parts import CORNERS, MotorHeat, Sole
from naoserver.errors import InvalidCommand
from naoserver.protocol.robot import JointReading
from visualhfsm_naoqi._names import AXES, DEVICES, GRAVITY, JOINT_KEYS, touch_key
from visualhfsm_naoqi.programs._access import Access, Service, needed
from visualhfsm_naoqi.programs._arguments import constant, text
from visualhfsm_naoqi.programs._behaviors import ALRobotPosture
from visualhfsm_naoqi.programs._calls import VERSION
from visualhfsm_naoqi.programs._leds import brightness_of_lamps

_MOST_SUBSCRIBERS: Final = 100
"""Of a client."""


def touch_part(name: str) -> str:
    """Return NAOqi's name for a touch sensor, such as `Head/Touch/Front`."""
    return touch_key(name).removeprefix(DEVICES).removesuffix("/Sensor/Value")


class Extractor(Service):
    """A service that measures while it has subscribers."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        # Period and precision, without effect, by name.
        self._subscribers = self._bounded("subscribers", _MOST_SUBSCRIBERS)

    def subscribe(self, name: object, period: object = 100, precision: object = 0.0) -> None:
        """Start measuring for a subscriber."""
        self._require()
        with self._lock:
            self._subscribers[text(name, "name")] = (period, precision)

    def unsubscribe(self, name: object) -> None:
        """Stop measuring for a subscriber; it measures while one is left."""
        with self._lock:
            if self._subscribers.pop(text(name, "name"), None) is None:
                raise InvalidCommand("name", f"{str(name)[:60]!r} has not subscribed")

    def getSubscribersInfo(self) -> list[list[object]]:
        """Return name, period and precision of each subscriber."""
        with self._lock:
            return [[name, *wanted] for name, wanted in self._subscribers.items()]

    def _wanted(self) -> bool:
        return bool(self._subscribers)

    def _require(self) -> None:
        """Raise HardwareFailure when it cannot measure."""
        raise NotImplementedError


class ALSonar(Extractor):
    """Turn the sonar on and off; ALMemory has its newest reading while there are subscribers."""

    _newest = (0.0, 0.0)

    def unsubscribe(self, name: object) -> None:
        """Turn the sonar off for a subscriber; it is off when none is left."""
        self._distances()
        super().unsubscribe(name)

    def _require(self) -> None:
        needed(self._robot.senses, "has no sonar")

    def _distances(self) -> tuple[float, float]:
        """Return the distances to the left and to the right in m; both 0 before anybody subscribed."""
        if self._subscribers and self._robot.senses is not None:
            reading = self._robot.senses.read().sonar
            self._newest = (reading.left, reading.right)
        return self._newest


class ALTouch(Service):
    """Report which sensors are touched."""

    def getSensorList(self) -> list[str]:
        """Return the names of the sensors, such as `Head/Touch/Front`."""
        return [name for name, *_ in self.getStatus()]

    def getStatus(self) -> list[list[Any]]:
        """Return the name of each sensor, whether it is touched, and an empty list."""
        senses = needed(self._robot.senses, "feels no touch")
        touched = senses.read().touched
        return [[touch_part(name), name in touched, []] for name in senses.touch_names]


class ALBattery(Service):
    """Report the charge of the battery."""

    def getBatteryCharge(self) -> int:
        """Return the charge in percent."""
        return round(100 * needed(self._robot.senses, "has no battery").read().battery.charge)


class ALSystem(Service):
    """Describe the robot."""

    systemVersion = constant("Return the version of NAOqi.", VERSION)

    def robotName(self) -> str:
        """Return the name of the robot."""
        return self._robot.name

    def systemInfo(self) -> list[list[str]]:
        """Return names and values of facts about the system."""
        return [["robotName", self.robotName()], ["version", VERSION], ["body", self._robot.body.name]]


class ALRobotModel(Service):
    """Describe the body."""

    getRobotType = constant("Return the kind of robot.", "Nao")
    hasArms = hasLegs = constant("Return True.", True)

    def hasHands(self) -> bool:
        """Return whether it has hands that move."""
        return bool(self._access.joints.hands)


TOUCH: Final = "TouchChanged"
"""The event of all touch sensors; its value is their states."""
NOTHING_NEAR: Final = 5.0
"""Distance in m of the sonar when nothing is in its range."""
_ECHOES: Final = 9
"""Further echoes for which each side of the sonar has a key; none is heard here."""
_FULL: Final = 0.99
"""Charge of a battery that counts as full."""
_STANDS: Final = 1.0
"""Mass in kg on a foot that touches the ground."""
_CONFIG: Final = {
    "RobotConfig/Body/Type": "Nao",
    "RobotConfig/Body/BaseVersion": "V6.0",
    "RobotConfig/Head/Type": "Nao",
    "RobotConfig/Head/BaseVersion": "V6.0",
    "Device/DeviceList/ChestBoard/BodyId": "00000ALDR1008E000000",
}
"""Facts of the body. Source: what NAOqi 2.1 logs in its own simulator when it starts."""
_WARM: Final = 0.3
"""Part of the way from a hot to a too hot motor at which it gives less than 70 % of its torque."""

_SIDES: Final = ("Left", "Right")

_Column = tuple[Sequence[str], Callable[[JointReading], Iterable[object]]]
"""A key of each joint, and what reads their values."""
Part = Callable[[], Mapping[str, Any]]
"""Reads a part of the keys that the robot itself keeps, always the same ones, with their values."""


def parts_of(access: Access) -> Iterator[Part]:
    """Return the parts of the keys that the robot itself keeps."""
    robot, postures = access.robot, access.service(ALRobotPosture)
    yield lambda: {**_CONFIG, "robotHasFallen": robot.state().fallen}
    yield lambda: {"PostureChanged": postures.getPosture()}
    yield lambda: {"PostureFamilyChanged": postures.getPostureFamily()}
    yield lambda: {"robotPoseChanged": postures._pose()}
    joints = _columns(robot.body)
    yield lambda: dict(_of_joints(joints, access.body.read()))
    if (lights := robot.lights) is not None:
        yield lambda: {f"{DEVICES}{name}": level for name, level in brightness_of_lamps(lights.colors())}
    if (senses := robot.senses) is not None:
        sonar, soles = access.service(ALSonar), robot.body.soles
        yield lambda: dict(_of_senses(senses.touch_names, senses.read(), sonar._distances(), soles))
        if (walk := access.walk) is not None:
            yield lambda: {f"{DEVICES}InertialSensor/AngleZ/Sensor/Value": walk.read().heading}


def _columns(body: Body) -> list[_Column]:
    """Return the keys of the joints of a body."""
    steps = _steps(body.motor_heat)
    status = f"{DEVICES}{{}}/Temperature/Sensor/Status"
    current = f"{DEVICES}{{}}/ElectricCurrent/Sensor/Value"
    values: dict[str, Callable[[JointReading], Iterable[object]]] = {
        **{key: attrgetter(part) for part, key in JOINT_KEYS.items()},
        current: lambda reading: body.motor_currents(reading.torques),
        status: lambda reading: [bisect_right(steps, each) for each in reading.temperatures],
    }
    return [([key.format(name) for name in body.joint_names], read) for key, read in values.items()]


def _of_joints(columns: Iterable[_Column], reading: JointReading) -> Iterator[tuple[str, object]]:
    """Yield keys and values of the joints."""
    for names, read in columns:
        yield from zip(names, read(reading), strict=True)
    yield "DCM/Time", round(reading.time * 1000)
    yield "robotIsWakeUp", min(reading.stiffnesses) > 0.0


def _steps(heat: MotorHeat | None) -> tuple[float, ...]:
    """Return the temperatures in degrees Celsius from which the status of a motor is 1, 2 and 3."""
    if heat is None:
        return ()
    return heat.hot, heat.hot + _WARM * (heat.too_hot - heat.hot), heat.too_hot


def _of_foot(side: str, foot: FootReading, sole: Sole) -> Iterator[tuple[str, object]]:
    """Yield keys and values of the foot on a side, `Left` or `Right`."""
    prefix = f"{DEVICES}{side[0]}Foot/FSR/"
    for name, force in zip((*CORNERS, "TotalWeight"), (*astuple(foot), foot.total), strict=True):
        yield f"{prefix}{name}/Sensor/Value", force / GRAVITY
    for name, center in zip("XY", sole.center(foot), strict=True):
        yield f"{prefix}CenterOfPressure/{name}/Sensor/Value", center
    mass = foot.total / GRAVITY
    yield f"{side.lower()}FootTotalWeight", mass
    yield f"{side.lower()}FootContact", float(mass > _STANDS)


def _of_senses(
    touch_names: Sequence[str], reading: SenseReading, distances: tuple[float, float], soles: Sequence[Sole]
) -> Iterator[tuple[str, object]]:
    """Yield keys and values; `distances` are those of the sonar to the left and to the right in m."""
    unit = f"{DEVICES}InertialSensor/"
    inertial = reading.inertial
    battery = reading.battery
    for axis, pull, turning in zip(AXES, inertial.acceleration, inertial.angular_velocity, strict=True):
        # The short names are those of the NAO4 and older, the long ones were introduced with the NAO5.
        for name in ("Acc", "Accelerometer"):  # gravity and inertia: -9.8 m/s2 along z on a standing NAO6
            yield f"{unit}{name}{axis}/Sensor/Value", -pull
        for name in ("Gyr", "Gyroscope"):
            yield f"{unit}{name}{axis}/Sensor/Value", turning
    yield f"{unit}GyrRef/Sensor/Value", 0.0  # what those of a NAO4 subtract
    yield f"{unit}AngleX/Sensor/Value", inertial.roll
    yield f"{unit}AngleY/Sensor/Value", inertial.pitch
    for side, foot, sole in zip(_SIDES, (reading.left_foot, reading.right_foot), soles, strict=True):
        yield from _of_foot(side, foot, sole)
    heavier = max(reading.left_foot.total, reading.right_foot.total) / GRAVITY
    for name in ("footContact", "footContactChanged"):
        yield name, float(heavier > _STANDS)
    yield from _of_sonar(distances)
    for part in ("Charge", "Current", "Temperature"):
        yield f"{DEVICES}Battery/{part}/Sensor/Value", getattr(battery, part.lower())
    yield "BatteryChargeChanged", round(100 * battery.charge)
    yield "BatteryPowerPluggedChanged", battery.plugged
    yield "BatteryFullChargedFlagChanged", battery.charge >= _FULL
    for name in touch_names:
        yield touch_key(name), float(name in reading.touched)
        if event := _touch_event(name):
            yield event, float(name in reading.touched)
    yield TOUCH, [[touch_part(name), name in reading.touched] for name in touch_names]
    for side in _SIDES:
        bumpers = [name for name in touch_names if name.startswith(f"{side[0]}FootBumper")]
        yield f"{side}BumperPressed", float(not reading.touched.isdisjoint(bumpers))


def _of_sonar(distances: tuple[float, float]) -> Iterator[tuple[str, object]]:
    """Yield keys and values: the nearest echo of each side, no further ones, and the nearest of both."""
    prefix = f"{DEVICES}US/"
    yield f"{prefix}Actuator/Value", 0.0
    yield f"{prefix}Sensor/Value", min(*distances, NOTHING_NEAR)
    for side, distance in zip(_SIDES, distances, strict=True):
        yield f"{prefix}{side}/Sensor/Value", min(distance, NOTHING_NEAR)
        for echo in range(1, _ECHOES + 1):
            yield f"{prefix}{side}/Sensor/Value{echo}", NOTHING_NEAR


def _touch_event(name: str) -> str | None:
    """Return the event of a touch sensor; None for a bumper, because both of a foot share one event."""
    if name == "ChestButton":
        return "ChestButtonPressed"
    if name.startswith("Head"):
        return f"{name.removeprefix('Head')}TactilTouched"
    if name[1:].startswith("Hand"):
        return f"Hand{'Left' if name[0] == 'L' else 'Right'}{name[5:]}Touched"
    return None
