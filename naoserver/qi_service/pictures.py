"""Pictures in NAOqi's sizes and colour spaces."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.pixel_formats import PIXEL_FORMATS
from naoserver.robot import CameraFacts, Frame

__all__ = ["COLOR_SPACES", "LAYERS", "SIZES", "shrunk", "source_size"]

Pixels = NDArray[np.uint8]

SIZES: Final[Mapping[int, tuple[int, int]]] = MappingProxyType(
    {
        0: (160, 120),
        1: (320, 240),
        2: (640, 480),
        3: (1280, 960),
        4: (2560, 1920),
        5: (1280, 720),
        6: (1920, 1080),
        7: (80, 60),
        8: (40, 30),
    }
)
"""Width and height by NAOqi's number of a resolution (alvisiondefinitions.h)."""


def _yuv(rgb: Pixels) -> bytes:
    """Return Y U V of each pixel, of which two beside each other share both chromas."""
    height, width = rgb.shape[:2]
    pairs = np.frombuffer(PIXEL_FORMATS["YUV422"](rgb), np.uint8).reshape(height, width // 2, 4)
    yuv = np.empty((height, width, 3), np.uint8)
    yuv[:, :, 0] = pairs[:, :, 0::2].reshape(height, width)
    yuv[:, :, 1] = pairs[:, :, 1].repeat(2, axis=1)
    yuv[:, :, 2] = pairs[:, :, 3].repeat(2, axis=1)
    return yuv.tobytes()


COLOR_SPACES: Final[Mapping[int, Callable[[Pixels], bytes]]] = MappingProxyType(
    {
        0: PIXEL_FORMATS["GRAY8"],
        9: PIXEL_FORMATS["YUV422"],
        10: _yuv,
        11: PIXEL_FORMATS["RGB8"],
        13: PIXEL_FORMATS["BGR8"],
    }
)
"""What makes a colour space's bytes of an RGB picture, by NAOqi's number: Y, YUV422, YUV, RGB, BGR."""
LAYERS: Final[Mapping[int, int]] = MappingProxyType({0: 1, 9: 2, 10: 3, 11: 3, 13: 3})
"""Bytes a pixel of each colour space."""


def source_size(facts: CameraFacts, size: tuple[int, int]) -> tuple[int, int] | None:
    """Return the size in which a camera takes a picture that is to have `size`: that, or a multiple of it.

    None when there is neither.
    """
    fitting = [
        own
        for own in facts.sizes
        if own[0] % size[0] == 0 and own[1] % size[1] == 0 and own[0] // size[0] == own[1] // size[1]
    ]
    return min(fitting, default=None)


def shrunk(frame: Frame, size: tuple[int, int]) -> Pixels:
    """Return the pixels of a frame in a size that divides its own: each the mean of those it stands for."""
    factor = frame.width // size[0]
    if factor == 1:
        return frame.pixels
    blocks = frame.pixels.reshape(size[1], factor, size[0], factor, 3)
    means: Pixels = blocks.mean(axis=(1, 3)).astype(np.uint8)
    return means
