"""ALSonar and ALTouch: what the robot feels."""

from __future__ import annotations

import threading
from typing import Final

from naoserver.capabilities import Senses
from naoserver.errors import HardwareFailure, InvalidCommand
from naoserver_qi.arguments import text
from naoserver_qi.keys import touch_part

_MOST_SUBSCRIBERS: Final = 100


class Extractor:
    """A service that measures while it has subscribers."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscribers: dict[str, tuple[object, object]] = {}  # period and precision, without effect

    def subscribe(self, name: object, period: object = 100, precision: object = 0.0) -> None:
        """Measure from now on, for a subscriber."""
        self._require()
        with self._lock:
            if len(self._subscribers) >= _MOST_SUBSCRIBERS:
                raise InvalidCommand("name", f"there are {_MOST_SUBSCRIBERS} subscribers already")
            self._subscribers[text(name, "name")] = (period, precision)

    def unsubscribe(self, name: object) -> None:
        """Measure no more for a subscriber, and not at all when none is left."""
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

    def __init__(self, senses: Senses | None) -> None:
        """Serve the sonar of some senses; None of a robot that has none."""
        super().__init__()
        self._senses = senses
        self._newest = (0.0, 0.0)

    def unsubscribe(self, name: object) -> None:
        """Turn the sonar off for a subscriber; it is off when none is left."""
        self._distances()
        super().unsubscribe(name)

    def _require(self) -> None:
        if self._senses is None:
            raise HardwareFailure("this robot has no sonar")

    def _distances(self) -> tuple[float, float]:
        """Return the distances to the left and to the right in m; both 0 before anybody subscribed."""
        if self._subscribers and self._senses is not None:
            reading = self._senses.read().sonar
            self._newest = (reading.left, reading.right)
        return self._newest


class ALTouch:
    """Say which sensors somebody touches."""

    def __init__(self, senses: Senses | None) -> None:
        self._found = senses

    @property
    def _senses(self) -> Senses:
        if self._found is None:
            raise HardwareFailure("this robot feels no touch")
        return self._found

    def getSensorList(self) -> list[str]:
        """Return the names of the sensors, such as `Head/Touch/Front`."""
        return [touch_part(name) for name in self._senses.touch_names]

    def getStatus(self) -> list[list[object]]:
        """Return name, whether it is touched, and nothing else of each sensor."""
        touched = self._senses.read().touched
        return [[touch_part(name), name in touched, []] for name in self._senses.touch_names]
