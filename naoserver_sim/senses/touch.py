"""What is touched: bumpers by what the feet run into, the other sensors by whoever sets the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from naoserver.body import H25
from naoserver.errors import InvalidCommand

BUMPERS: Final = ("LFootBumperLeft", "LFootBumperRight", "RFootBumperLeft", "RFootBumperRight")
"""The bumpers in the order of `SensorLayout.bumpers`."""
_SWITCHES_AT: Final = 1.0
"""Force in N that presses a bumper."""


@dataclass(frozen=True, slots=True)
class _Press:
    sensor: str
    begin: float
    end: float


class Touch:
    """Tell what is pressed at a time. Safe to use from any thread."""

    def __init__(self) -> None:
        self._presses: tuple[_Press, ...] = ()

    def press(self, sensor: str, begin: float, seconds: float) -> None:
        """Press a sensor for some seconds. Raises InvalidCommand when there is none of that name."""
        if sensor not in H25.touch_sensors:
            names = ", ".join(H25.touch_sensors)
            raise InvalidCommand(sensor, f"there is no touch sensor {sensor!r}; there are {names}")
        pressed = tuple(press for press in self._presses if press.end > begin - 1.0)
        self._presses = (*pressed, _Press(sensor, begin, begin + seconds))

    def touched(self, time: float, bumps: tuple[float, ...]) -> frozenset[str]:
        """Return what is pressed, by the forces on the bumpers in N and by who presses."""
        names = {press.sensor for press in self._presses if press.begin <= time < press.end}
        names.update(name for name, force in zip(BUMPERS, bumps, strict=True) if force >= _SWITCHES_AT)
        return frozenset(names)
