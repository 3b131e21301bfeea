"""ALSonar, ALTouch, ALBattery, ALSystem and ALRobotModel: some senses of the robot, its name and its body."""

from __future__ import annotations

from typing import Any, Final

from naoserver._naoqi_names import DEVICES, touch_key
from naoserver.errors import InvalidCommand
from naoserver.qi._access import Access, Service, needed
from naoserver.qi._arguments import constant, text
from naoserver.qi._modules import VERSION

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
