"""NAOqi's names of single lamps. A light of ours is a group of them, so that a lamp means its whole group."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Final

from naoserver._naoqi_names import LIGHT_GROUPS
from naoserver.capabilities import Color

COLORS: Final = ("Red", "Green", "Blue")
"""The parts of a color, in its order."""
_SIDES: Final = ("Left", "Right")
_HEAD: Final = {"Front": 2, "Middle": 1, "Rear": 3}
"""Lamps of each row on the head, on each side."""


def _lamps() -> Iterator[tuple[str, str, int | None]]:
    """Yield name, light and the number of its only color, None for a lamp that has all that it can show."""
    for color, part in enumerate(COLORS):
        yield f"ChestBoard/Led/{part}", "Chest", color
        for side in _SIDES:
            yield f"{side[0]}Foot/Led/{part}", f"{side}Foot", color
            for angle in range(0, 360, 45):
                yield f"Face/Led/{part}/{side}/{angle}Deg", f"{side}Eye", color
    for side in _SIDES:
        for angle in range(0, 360, 36):
            yield f"Ears/Led/{side}/{angle}Deg", f"{side}Ear", None
        for row, count in _HEAD.items():
            for number in range(count):
                yield f"Head/Led/{row}/{side}/{number}", "Head", None


LAMPS: Final[Mapping[str, tuple[str, int | None]]] = {
    f"{name}/Actuator/Value": (light, color) for name, light, color in _lamps()
}
"""Light and color of each lamp, by the name of its device."""

_NAME: Final = re.compile(
    r"(Left|Right)?(Face|Ear|Brain)Led(Left|Right)?\d{1,2}"
    r"|(Left|Right)?(Face|Ear|Brain)Leds(Left|Right)?(Top|Bottom|Internal|External|Front|Middle|Back|Even|Odd)"
    r"|(Face|Ears|Head|ChestBoard|[LR]Foot)/Led/\S{1,60}"
)
"""Names of lamps, short ones and those of devices, and of groups of lamps within a light."""
_LIGHTS: Final = {
    "Face": "Eye",
    "Ear": "Ear",
    "Foot": "Foot",
    "Brain": "Head",
    "Head": "Head",
    "ChestBoard": "Chest",
}
"""The light at each place of lamps, without its side."""


def lights_of(name: str) -> tuple[tuple[str, ...], str] | None:
    """Return the lights that a lamp means, and the only part of their color, empty for all; None for none."""
    if not _NAME.fullmatch(name):
        return None
    light = next(light for place, light in _LIGHTS.items() if place in name)
    sides = _SIDES if f"Left{light}" in LIGHT_GROUPS else ("",)
    meant = [side for side in sides if side in name or name.startswith(f"{side[:1]}Foot")]
    part = next((part for part in COLORS if part in name), "")
    return tuple(f"{side}{light}" for side in meant or sides), part


def brightness(lamp: tuple[str, int | None], shown: Mapping[str, Color]) -> float:
    """Return how bright a lamp of `LAMPS` is, from 0 to 1, with the lights that are shown."""
    light, color = lamp
    return max(shown[light]) if color is None else shown[light][color]
