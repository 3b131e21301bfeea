"""Pictures of a run, few and evenly spread however long it lasts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from interfaces.jderobot import ImageData

__all__ = ["Album", "Picture", "picture_from"]

_FIRST_INTERVAL: Final = 1.0
_MOST: Final = 24


@dataclass(frozen=True, slots=True)
class Picture:
    """An RGB8 image at a component time; `mark` is a point in pixels, right and down from its corner."""

    time: float
    caption: str
    width: int
    height: int
    pixels: bytes
    mark: tuple[float, float] | None = None


class Album:
    """At most 24 pictures: when it is full, every other one goes and the interval doubles."""

    def __init__(self) -> None:
        self._pictures: list[Picture] = []
        self._interval = _FIRST_INTERVAL
        self._next = 0.0

    def due(self, time: float) -> bool:
        """Whether a picture at this component time is wanted."""
        return time >= self._next

    def add(self, picture: Picture) -> None:
        """Put a picture in."""
        self._pictures.append(picture)
        if len(self._pictures) >= _MOST:
            del self._pictures[1::2]
            self._interval *= 2
        self._next = picture.time + self._interval

    def choose(self, count: int) -> Sequence[Picture]:
        """Return at most `count` pictures, evenly spread, the first and the last among them."""
        if len(self._pictures) <= count:
            return tuple(self._pictures)
        step = (len(self._pictures) - 1) / max(count - 1, 1)
        return tuple(self._pictures[round(number * step)] for number in range(count))


def picture_from(
    image: ImageData, time: float, caption: str, mark: tuple[float, float] | None = None
) -> Picture | None:
    """Make a picture of an RGB8 image, or None of one whose size does not fit its pixels."""
    width, height = image.description.width, image.description.height
    if width <= 0 or height <= 0 or len(image.pixelData) != width * height * 3:
        return None
    return Picture(time, caption, width, height, bytes(image.pixelData), mark)
