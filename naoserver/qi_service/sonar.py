"""ALSonar: who wants the sonar."""

from __future__ import annotations

import threading
from typing import Final

from naoserver.capabilities import Senses
from naoserver.errors import HardwareFailure, InvalidCommand
from naoserver.qi_service.values import text

__all__ = ["ALSonar", "Sonar"]

_MOST: Final = 100


class Sonar:
    """The sonar as ALMemory tells of it: what it felt last, while somebody wanted it."""

    def __init__(self, senses: Senses | None) -> None:
        self.senses: Final = senses
        """The senses that feel it; None of a robot that has none."""
        self.subscribers: Final[dict[str, tuple[object, object]]] = {}
        """Period and precision that each subscriber wants, neither of which matters."""
        self._newest = (0.0, 0.0)

    def distances(self) -> tuple[float, float]:
        """Return the distances to the left and to the right in m; both 0 before anybody wanted them."""
        if self.subscribers and self.senses is not None:
            reading = self.senses.read().sonar
            self._newest = (reading.left, reading.right)
        return self._newest


class ALSonar:
    """Turn the sonar on and off."""

    def __init__(self, sonar: Sonar) -> None:
        self._sonar = sonar
        self._lock = threading.Lock()

    def subscribe(self, name: object, period: object = 100, precision: object = 0.0) -> None:
        """Turn the sonar on for somebody."""
        subscribers = self._sonar.subscribers
        if self._sonar.senses is None:
            raise HardwareFailure("this robot has no sonar")
        with self._lock:
            if len(subscribers) >= _MOST:
                raise InvalidCommand("name", f"the sonar has {_MOST} subscribers already")
            subscribers[text(name, "name")] = (period, precision)

    def unsubscribe(self, name: object) -> None:
        """Turn the sonar off for somebody; it is off when nobody wants it any more."""
        self._sonar.distances()
        with self._lock:
            if self._sonar.subscribers.pop(text(name, "name"), None) is None:
                raise InvalidCommand("name", f"{str(name)[:60]!r} has not subscribed")

    def getSubscribersInfo(self) -> list[list[object]]:
        """Return name, period and precision of each subscriber."""
        with self._lock:
            return [[name, *wanted] for name, wanted in self._sonar.subscribers.items()]
