"""Pixel formats of images, made from a robot's RGB frames."""

from __future__ import annotations

import io
from collections.abc import Callable
from importlib.util import find_spec
from typing import Final

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]

JPEG_QUALITY: Final = 85
"""A picture of 320x240 takes about 10 kB, a twentieth of its pixels."""


def _gray(rgb: Pixels) -> bytes:
    """Return the luma of ITU-R BT.601 in 8-bit fixed point."""
    red, green, blue = (rgb[:, :, channel].astype(np.uint16) for channel in range(3))
    return ((77 * red + 150 * green + 29 * blue) >> 8).astype(np.uint8).tobytes()


def _yuv422(rgb: Pixels) -> bytes:
    """Return Y U Y V for each two pixels of a row: ITU-R BT.601 in video range, in 8-bit fixed point."""
    height, width = rgb.shape[:2]
    red, green, blue = (rgb[:, :, channel].astype(np.int32) for channel in range(3))
    packed = np.empty((height, width // 2, 4), np.uint8)
    packed[:, :, 0::2] = (((66 * red + 129 * green + 25 * blue + 128) >> 8) + 16).reshape(height, -1, 2)
    red, green, blue = (channel[:, 0::2] + channel[:, 1::2] for channel in (red, green, blue))
    packed[:, :, 1] = ((-38 * red - 74 * green + 112 * blue + 256) >> 9) + 128
    packed[:, :, 3] = ((112 * red - 94 * green - 18 * blue + 256) >> 9) + 128
    return packed.tobytes()


def _jpeg(rgb: Pixels) -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(rgb).save(buffer, "JPEG", quality=JPEG_QUALITY)
    return buffer.getvalue()


PIXEL_FORMATS: Final[dict[str, Callable[[Pixels], bytes]]] = {
    "RGB8": lambda rgb: rgb.tobytes(),
    "BGR8": lambda rgb: rgb[:, :, ::-1].tobytes(),
    "GRAY8": _gray,
    "YUV422": _yuv422,
}
"""Converters of a frame of shape (height, width, 3), width even, to a format's bytes, rows from the top."""
if find_spec("PIL") is not None:  # not in a plain installation of a server
    PIXEL_FORMATS["JPEG"] = _jpeg

STREAMED_FORMAT: Final = "RGB8"
STREAMED_BYTES_A_PIXEL: Final = 3
