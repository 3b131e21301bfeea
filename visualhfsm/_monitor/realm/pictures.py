"""Earlier images of the cameras, as JPEG: the newest that fit."""

from __future__ import annotations

import io
import math
from collections import deque
from collections.abc import Iterable
from typing import Final, TypeVar

from visualhfsm._base.errors import MissingPackageError, VisualHfsmError

T = TypeVar("T")

OLDEST: Final = 2.0
"""Seconds for which an image counts as that of a later moment."""

_QUALITY: Final = 80
"""JPEG quality, from 1 to 95; an image of 320 x 240 takes about 12 kB."""
_LARGEST_SIDE: Final = 4096
"""Limit of the width and the height in pixels."""
_KEPT_BYTES: Final = 32 << 20
"""Limit in bytes of the kept images of all cameras: 22 minutes of one camera at two of 12 kB a second."""
_KEPT_INTERVAL: Final = 0.45
"""Wall seconds between two images of a camera that are kept."""


class Pictures:
    """Earlier images of the cameras, the newest that fit, by the wall time at which they arrived."""

    def __init__(self, most_bytes: int = _KEPT_BYTES) -> None:
        self._most_bytes = most_bytes
        self._kept: deque[tuple[float, str, bytes]] = deque()
        self._bytes = 0
        self._latest: dict[str, float] = {}

    def add(self, camera: str, at: float, jpeg: bytes) -> None:
        """Keep an image, unless one of this camera was kept just before."""
        if not self.due(camera, at):
            return
        self._latest[camera] = at
        self._kept.append((at, camera, jpeg))
        self._bytes += len(jpeg)
        while self._bytes > self._most_bytes:
            self._bytes -= len(self._kept.popleft()[2])

    def due(self, camera: str, at: float, apart: float = _KEPT_INTERVAL) -> bool:
        """Return whether the last image of a camera was kept at least `apart` s before a wall time."""
        return not 0.0 <= at - self._latest.get(camera, -math.inf) < apart

    def at(self, camera: str, at: float) -> bytes | None:
        """Return the last image of a camera up to a wall time; None if there is none from about then."""
        for taken, name, jpeg in reversed(self._kept):
            if name == camera and taken <= at:
                return jpeg if at - taken <= OLDEST else None
        return None

    def spread(self, most: int, since: float, until: float) -> dict[str, list[tuple[float, bytes]]]:
        """Return at most `most` kept images by camera, each with its wall time, evenly over that time."""
        found: dict[str, list[tuple[float, bytes]]] = {}
        for taken, camera, jpeg in evenly((each for each in self._kept if since <= each[0] <= until), most):
            found.setdefault(camera, []).append((taken, jpeg))
        return found


def evenly(items: Iterable[T], most: int) -> list[T]:
    """Return at most `most` items, evenly spaced."""
    kept = list(items)
    return kept[:: -(-len(kept) // max(1, most)) or 1]


def encode_jpeg(width: int, height: int, pixels: bytes) -> bytes:
    """Return an RGB8 image as JPEG; raises VisualHfsmError when its size does not fit its pixels."""
    from PIL import Image

    if not (0 < width <= _LARGEST_SIDE and 0 < height <= _LARGEST_SIDE) or len(pixels) != width * height * 3:
        raise VisualHfsmError.because(
            "an image of {width} x {height} has {count} bytes, not 3 for each pixel",
            width=width,
            height=height,
            count=len(pixels),
        )
    buffer = io.BytesIO()
    Image.frombuffer("RGB", (width, height), pixels, "raw", "RGB", 0, 1).save(
        buffer, "JPEG", quality=_QUALITY
    )
    return buffer.getvalue()


def require_pillow() -> None:
    """Raise MissingPackageError without Pillow."""
    try:
        import PIL.Image  # noqa: F401
    except ModuleNotFoundError as error:
        raise MissingPackageError("Pillow", "web") from error
