"""What is touched: bumpers by what the feet run into, the other sensors by whoever sets the scene."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from naoserver.body import H25
from naoserver.errors import InvalidCommand

BUMPERS: Final = ("LFootBumperLeft", "LFootBumperRight", "RFootBumperLeft", "RFootBumperRight")
"""The bumpers in the order of `SensorLayout.bumpers`."""
_LONGEST_NAME: Final = 64  # characters of a client's text that are told back
_SWITCHES_AT: Final = 1.0
"""Force in N that presses a bumper."""


@dataclass(frozen=True, slots=True)
class _Press:
    begin: float
    end: float


class Touch:
    """Tell what is pressed at a time. Safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._presses: Mapping[str, _Press] = {}  # the newest of each sensor; replaced as a whole

    def press(self, sensor: str, begin: float, seconds: float) -> None:
        """Press a sensor for some seconds, and for as long as it is pressed already.

        Raises InvalidCommand when there is none of that name.
        """
        if sensor not in H25.touch_sensors:
            name, names = sensor[:_LONGEST_NAME], ", ".join(H25.touch_sensors)
            raise InvalidCommand("name", f"there is no touch sensor {name!r}; there are {names}")
        press = _Press(begin, begin + seconds)
        with self._lock:
            before = self._presses.get(sensor)
            if before is not None and before.end >= begin:
                press = _Press(before.begin, max(before.end, press.end))
            self._presses = {**self._presses, sensor: press}

    def touched(self, time: float, bumps: tuple[float, ...]) -> frozenset[str]:
        """Return what is pressed, by the forces on the bumpers in N and by who presses."""
        names = {sensor for sensor, press in self._presses.items() if press.begin <= time < press.end}
        names.update(name for name, force in zip(BUMPERS, bumps, strict=True) if force >= _SWITCHES_AT)
        return frozenset(names)
