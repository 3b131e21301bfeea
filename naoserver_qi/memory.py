"""ALMemory: values under keys, and signals and callbacks that send their changes; ALAutonomousLife."""

from __future__ import annotations

import logging
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, Final, NamedTuple

import qi

from naoserver.capabilities import SenseReading
from naoserver.errors import InvalidCommand
from naoserver.naoqi_names import AXES, DEVICES, GRAVITY, JOINT_KEYS, touch_key
from naoserver.robot import JointReading
from naoserver_qi.access import Access, Service
from naoserver_qi.arguments import chosen, keepable, text, texts
from naoserver_qi.clients import Client
from naoserver_qi.postures import ALRobotPosture
from naoserver_qi.sensors import ALSonar, touch_part

_logger = logging.getLogger(__name__)

NOTIFYING: Final = 0.02
"""Wall seconds between two checks for changes."""
MOST_KEYS: Final = 250
"""Maximum keys of a client, and maximum keys to which it listens."""
MOST_LEFT: Final = 1000
"""Maximum keys that lost clients leave behind; the oldest ones go first."""
MOST_CALLBACKS: Final = 100
"""Maximum callbacks of a client."""
_RAISED: Final = (
    "ALTextToSpeech/CurrentSentence",
    "ALTextToSpeech/TextDone",
    "ALTextToSpeech/TextStarted",
    "ALTracker/ColorBlobDetected",
    "AutonomousLife/State",
    "FaceDetected",
    "LandmarkDetected",
    "redBallDetected",
)
"""The events that services raise; they take no room from the keys of clients."""


# -- keys that the robot itself keeps ---------------------------------------------------------------------

TOUCH: Final = "TouchChanged"
"""The event of all touch sensors; its value is their states."""
NOTHING_NEAR: Final = 5.0
"""Distance in m of the sonar when nothing is in its range."""
_FULL: Final = 0.99
"""Charge of a battery that counts as full."""
_STANDS: Final = 1.0
"""Mass in kg on a foot that touches the ground."""
_CONFIG: Final = {
    "RobotConfig/Body/Type": "nao",
    "RobotConfig/Body/BaseVersion": "V6.0",
    "RobotConfig/Head/BaseVersion": "V6.0",
}
_FOOT_KEYS: Final = {
    "FrontLeft": "front_left",
    "FrontRight": "front_right",
    "RearLeft": "rear_left",
    "RearRight": "rear_right",
    "TotalWeight": "total",
}
"""The part of a FootReading under each key of a foot."""

Part = Callable[[], Mapping[str, Any]]
"""Reads a part of the keys that the robot itself keeps, always the same ones, with their values."""


def parts_of(access: Access) -> Iterator[Part]:
    """Return the parts of the keys that the robot itself keeps."""
    body, robot, postures = access.body, access.robot, access.service(ALRobotPosture)
    keys = {part: [key.format(joint.name) for joint in body.joints] for part, key in JOINT_KEYS.items()}
    yield lambda: {**_CONFIG, "robotHasFallen": robot.state().fallen}
    yield lambda: {"PostureChanged": postures.getPosture()}
    yield lambda: {"PostureFamilyChanged": postures.getPostureFamily()}
    yield lambda: dict(_of_joints(keys, body.read()))
    if (senses := robot.senses) is not None:
        sonar = access.service(ALSonar)
        yield lambda: dict(_of_senses(senses.touch_names, senses.read(), sonar._distances()))
        if (walk := access.walk) is not None:
            yield lambda: {f"{DEVICES}InertialSensor/AngleZ/Sensor/Value": walk.read().heading}


def _of_joints(keys: Mapping[str, Sequence[str]], reading: JointReading) -> Iterator[tuple[str, object]]:
    """Yield keys and values; `keys` are those of the joints by fields of the reading."""
    for part, names in keys.items():
        yield from zip(names, getattr(reading, part), strict=True)
    yield "DCM/Time", round(reading.time * 1000)
    yield "robotIsWakeUp", min(reading.stiffnesses) > 0.0


def _of_senses(
    touch_names: Sequence[str], reading: SenseReading, distances: tuple[float, float]
) -> Iterator[tuple[str, object]]:
    """Yield keys and values; `distances` are those of the sonar to the left and to the right in m."""
    unit, inertial, battery = f"{DEVICES}InertialSensor/", reading.inertial, reading.battery
    for axis, pull, turning in zip(AXES, inertial.acceleration, inertial.angular_velocity, strict=True):
        # The short names are those of the NAO4 and older, the long ones were introduced with the NAO5.
        for name in ("Acc", "Accelerometer"):  # gravity and inertia: -9.8 m/s2 along z on a standing NAO6
            yield f"{unit}{name}{axis}/Sensor/Value", -pull
        for name in ("Gyr", "Gyroscope"):
            yield f"{unit}{name}{axis}/Sensor/Value", turning
    yield f"{unit}AngleX/Sensor/Value", inertial.roll
    yield f"{unit}AngleY/Sensor/Value", inertial.pitch
    masses = []
    for side, foot in (("Left", reading.left_foot), ("Right", reading.right_foot)):
        for name, part in _FOOT_KEYS.items():
            yield f"{DEVICES}{side[0]}Foot/FSR/{name}/Sensor/Value", getattr(foot, part) / GRAVITY
        mass = foot.total / GRAVITY
        yield f"{side.lower()}FootTotalWeight", mass
        yield f"{side.lower()}FootContact", float(mass > _STANDS)
        masses.append(mass)
    for name in ("footContact", "footContactChanged"):
        yield name, float(max(masses) > _STANDS)
    yield f"{DEVICES}US/Actuator/Value", 0.0
    for side, distance in zip(("Left", "Right"), distances, strict=True):
        yield f"{DEVICES}US/{side}/Sensor/Value", min(distance, NOTHING_NEAR)
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
    for side in ("Left", "Right"):
        bumpers = [name for name in touch_names if name.startswith(f"{side[0]}FootBumper")]
        yield f"{side}BumperPressed", float(not reading.touched.isdisjoint(bumpers))


def _touch_event(name: str) -> str | None:
    """Return the event of a touch sensor; None for a bumper, because both of a foot share one event."""
    if name == "ChestButton":
        return "ChestButtonPressed"
    if name.startswith("Head"):
        return f"{name.removeprefix('Head')}TactilTouched"
    if name[1:].startswith("Hand"):
        return f"Hand{'Left' if name[0] == 'L' else 'Right'}{name[5:]}Touched"
    return None


# -- the services -----------------------------------------------------------------------------------------


def _call(found: qi.Future, method: str, event: str, value: object, message: str = "") -> None:
    """Call back a program; log when it is gone, or has no such operation."""
    try:
        called = getattr(found.value(), method)(event, value, message, _async=True)
        called.addCallback(lambda done: _report(event, done.error()) if done.hasError() else None)
    except (AttributeError, RuntimeError) as error:
        _report(event, str(error))


def _report(event: str, error: str) -> None:
    _logger.warning("nobody was called back when %s changed: %s", event[:200], error[:500])


class Subscriber:
    """The result of ALMemory.subscriber: the signal of a key."""

    def __init__(self) -> None:
        self.signal = qi.Signal("(m)")


class _Heard(NamedTuple):
    """A key to which clients listen: its signal, and the subscriber that they get."""

    signal: qi.Signal
    lent: object


class ALMemory(Service):
    """Keep what clients and services insert, and look up everything else when it is asked for."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._parts = {key: part for part in parts_of(access) for key in part()}
        self._raised: dict[str, Any] = {}  # values of the services' own events
        self._inserted = self._bounded("keys", MOST_KEYS)
        self._left: dict[str, Any] = {}  # what lost clients had inserted, the oldest first
        self._heard: dict[str, _Heard] = {}
        self._listening = self._bounded("keys to which it listens", MOST_KEYS)  # by client and key
        self._callbacks = self._bounded("callbacks", MOST_CALLBACKS)  # links to signals by event and module
        self._seen: dict[str, Any] = {}
        self._unknown: set[str] = set()  # keys of which was logged that nothing raises them

    def getData(self, key: object, _lane: object = 0) -> Any:  # noqa: ANN401 - whatever stands there
        """Return the value of a key."""
        name = text(key, "key")
        found, value = self._look(name)
        if not found:
            raise InvalidCommand("key", f"there is no data under {name[:200]!r}")
        return value

    def getListData(self, keys: object) -> list[Any]:
        """Return the values of keys at one moment; None where there is none."""
        read = cache(operator.call)  # each part once
        return [self._look(key, read)[1] for key in texts(keys, "keys")]

    def insertData(self, key: object, value: object) -> None:
        """Write a value under a key without a signal; measured values stay."""
        name, kept = text(key, "key"), keepable(value, "value")
        with self._lock:
            if name in _RAISED:
                self._raised[name] = kept
            else:
                self._inserted[name] = kept
                self._left.pop(name, None)

    def raiseEvent(self, name: object, value: object) -> None:
        """Write a value under a key, and send its signal."""
        self.insertData(name, value)
        if (heard := self._heard.get(text(name, "name"))) is not None:
            heard.signal(value)

    raiseMicroEvent = raiseEvent

    def removeData(self, key: object) -> None:
        """Remove what was written under a key."""
        name = text(key, "key")
        with self._lock:
            for values in (self._raised, self._inserted, self._left):
                values.pop(name, None)

    def getDataListName(self) -> list[str]:
        """Return every key."""
        with self._lock:
            known = {*self._parts, *self._raised, *self._inserted, *self._left}
        return sorted(filter(self._access.faults._knows, known))

    def getDataList(self, filter: object) -> list[str]:
        """Return the keys that contain a text."""
        part = text(filter, "filter")
        return [key for key in self.getDataListName() if part in key]

    def subscriber(self, event: object) -> object:
        """Return an object whose `signal` sends the value of a key, or of a later event, at each change."""
        return self._listen(text(event, "event")).lent

    def subscribeToEvent(self, name: object, callbackModule: object, *callbackMethod: object) -> None:
        """Call a service's operation, named last, with key, value and the text before it at each change."""
        *message, method = (text(each, "callback") for each in callbackMethod or ("",))
        event, module = text(name, "event"), text(callbackModule, "module")
        if len(message) > 1 or not method or method.startswith("_"):
            raise InvalidCommand("callback", "give event, module and the operation to call")

        def call_back(value: object) -> None:
            self._access.find(module).addCallback(lambda found: _call(found, method, event, value, *message))

        self.unsubscribeToEvent(event, module)
        signal = self._listen(event).signal
        link = signal.connect(call_back)
        try:
            with self._lock:
                self._callbacks[event, module] = signal, link
        except InvalidCommand:
            signal.disconnect(link)
            raise

    def unsubscribeToEvent(self, name: object, callbackModule: object) -> None:
        """Stop calling a program's service when a key changes."""
        with self._lock:
            key = text(name, "event"), text(callbackModule, "module")
            signal, link = self._callbacks.pop(key, (None, 0))
        if signal is not None:
            signal.disconnect(link)

    subscribeToMicroEvent = subscribeToEvent
    unsubscribeToMicroEvent = unsubscribeToEvent

    def _notify(self) -> None:
        """Send the values that have changed since the last time to their subscribers."""
        with self._lock:
            read = cache(operator.call)  # each part once
            seen, self._seen = self._seen, {name: read(self._parts[name])[name] for name in self._seen}
            changed = {name: value for name, value in self._seen.items() if value != seen[name]}
        if TOUCH in changed:  # as on a robot, only the sensors that have changed
            changed[TOUCH] = [part for part in changed[TOUCH] if part not in seen[TOUCH]]
        for name, value in changed.items():
            if (heard := self._heard.get(name)) is not None:
                heard.signal(value)

    def _listen(self, name: str) -> _Heard:
        """Listen to a key for the current client; it is heard while one of its clients is there."""
        listener = self._access.calls.current.client, name
        value = self._look(name)[1]
        if (heard := self._heard.get(name)) is None:
            subscriber = Subscriber()
            heard = _Heard(subscriber.signal, self._access.lend(subscriber))
        with self._lock:
            self._listening[listener] = None
            if name not in self._heard:
                if name in self._parts:
                    self._seen[name] = value
                elif not any(name in known for known in (_RAISED, self._inserted, self._left)):
                    self._warn(name)
            return self._heard.setdefault(name, heard)

    def _warn(self, name: str) -> None:
        """Log once that nothing raises an event."""
        if name not in self._unknown and len(self._unknown) < MOST_LEFT:
            self._unknown.add(name)
            _logger.warning("%r never happens here unless a program raises it", name[:200])

    def _forget(self, client: Client) -> None:
        """Keep what a lost client had inserted; end its callbacks, and subscribers that nobody else has."""
        with self._lock:
            self._left |= self._inserted.take(client)
            for name in list(self._left)[:-MOST_LEFT]:
                del self._left[name]
            callbacks = self._callbacks.take(client)
            self._listening.take(client)
            for name in self._heard.keys() - {name for _, name in self._listening}:
                del self._heard[name]
                self._seen.pop(name, None)
        for signal, link in callbacks.values():
            signal.disconnect(link)

    def _look(
        self, key: str, read: Callable[[Part], Mapping[str, Any]] = operator.call
    ) -> tuple[bool, object]:
        """Return whether there is data under a key, and its value; `read` reads a part of the keys."""
        if not self._access.faults._knows(key):
            return False, None
        if key in self._parts:
            return True, read(self._parts[key])[key]
        with self._lock:
            for values in (self._raised, self._inserted, self._left):
                if key in values:
                    return True, values[key]
        return False, None


_STATES: Final = ("disabled", "solitary", "interactive", "safeguard")


class ALAutonomousLife(Service):
    """Remember the state of a life that the robot does not have: nothing moves by itself in any state."""

    _state = _STATES[0]

    def getState(self) -> str:
        """Return the state, at first `disabled`."""
        return self._state

    def setState(self, state: object) -> None:
        """Set the state."""
        self._state = chosen(state, "state", _STATES)
        self._access.service(ALMemory).raiseEvent("AutonomousLife/State", self._state)
