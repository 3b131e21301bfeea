"""The lights of a robot that has none to burn: colors that fade over the robot's time."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from naoserver.capabilities import Color

__all__ = ["SINGLE_COLORED", "START", "FadingLights"]

_WHITE: Final = (1.0, 1.0, 1.0)
_BLUE: Final = (0.0, 0.0, 1.0)
_OFF: Final = (0.0, 0.0, 0.0)

START: Final[Mapping[str, Color]] = MappingProxyType(
    {
        "LeftEye": _WHITE,
        "RightEye": _WHITE,
        "LeftEar": _BLUE,
        "RightEar": _BLUE,
        "Head": _BLUE,
        "Chest": _OFF,
        "LeftFoot": _OFF,
        "RightFoot": _OFF,
    }
)
"""What each group of an H25 shows after the start."""
SINGLE_COLORED: Final[Mapping[str, Color]] = MappingProxyType(
    dict.fromkeys(("LeftEar", "RightEar", "Head"), _BLUE)
)
"""The groups that have one color, and which."""


@dataclass(frozen=True, slots=True)
class _Fade:
    """A change from `start` on: from one color to another within some seconds."""

    before: Color
    after: Color
    start: float = 0.0
    seconds: float = 0.0

    def at(self, time: float) -> Color:
        left = self.start + self.seconds - time
        if left <= 0.0:
            return self.after
        share = min(1.0, left / self.seconds)
        red, green, blue = (a + (b - a) * share for a, b in zip(self.after, self.before, strict=True))
        return red, green, blue


class FadingLights:
    """The lights of an H25 on a clock, `now` in s of robot time. Implements Lights; safe from any thread."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._lock = threading.Lock()
        self._fades = {name: _Fade(color, color) for name, color in START.items()}

    @property
    def names(self) -> tuple[str, ...]:
        """The groups: eyes, ears, head, chest and feet."""
        return tuple(START)

    def set(self, name: str, color: Color, seconds: float) -> None:
        """Let a group fade to a color in some seconds of robot time. Raises KeyError for an unknown group."""
        if (only := SINGLE_COLORED.get(name)) is not None:
            brightness = max(color)
            color = (only[0] * brightness, only[1] * brightness, only[2] * brightness)
        with self._lock:
            now = self._now()
            self._fades[name] = _Fade(self._fades[name].at(now), color, now, seconds)

    def reset(self) -> None:
        """Let every group show what it shows after the start."""
        with self._lock:
            self._fades = {name: _Fade(color, color) for name, color in START.items()}

    def colors(self) -> Mapping[str, Color]:
        """Return what each group shows now."""
        with self._lock:
            now = self._now()
            return {name: fade.at(now) for name, fade in self._fades.items()}
