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


def _yuv(rgb: Pixels) -> Pixels:
    """Return luma and both chromas of ITU-R BT.601, full range, in 8-bit fixed point."""
    red, green, blue = (rgb[:, :, channel].astype(np.int32) for channel in range(3))
    luma = (77 * red + 150 * green + 29 * blue) >> 8
    u = ((-43 * red - 85 * green + 128 * blue) >> 8) + 128
    v = ((128 * red - 107 * green - 21 * blue) >> 8) + 128
    return np.clip(np.stack((luma, u, v), axis=2), 0, 255).astype(np.uint8)


def _yuv422(rgb: Pixels) -> bytes:
    """Return Y U Y V of each two pixels beside each other, which share the chromas of the left one."""
    yuv = _yuv(rgb)
    packed = np.empty((*rgb.shape[:2], 2), np.uint8)
    packed[:, :, 0] = yuv[:, :, 0]
    packed[:, 0::2, 1] = yuv[:, 0::2, 1]
    packed[:, 1::2, 1] = yuv[:, 0::2, 2]
    return packed.tobytes()


COLOR_SPACES: Final[Mapping[int, Callable[[Pixels], bytes]]] = MappingProxyType(
    {
        0: PIXEL_FORMATS["GRAY8"],
        9: _yuv422,
        10: lambda rgb: _yuv(rgb).tobytes(),
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
