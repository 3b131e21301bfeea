"""Pixel formats of images, made from a robot's RGB frames."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]


def _gray(rgb: Pixels) -> bytes:
    """Return the luma of ITU-R BT.601 in 8-bit fixed point."""
    red, green, blue = (rgb[:, :, channel].astype(np.uint16) for channel in range(3))
    return ((77 * red + 150 * green + 29 * blue) >> 8).astype(np.uint8).tobytes()


PIXEL_FORMATS: Final[Mapping[str, Callable[[Pixels], bytes]]] = MappingProxyType(
    {
        "RGB8": lambda rgb: rgb.tobytes(),
        "BGR8": lambda rgb: rgb[:, :, ::-1].tobytes(),
        "GRAY8": _gray,
    }
)
"""What turns a frame of shape (height, width, 3) into a format's bytes, rows from the top. RGB8 is first."""
BYTES_A_PIXEL: Final[Mapping[str, int]] = MappingProxyType({"RGB8": 3, "BGR8": 3, "GRAY8": 1})
