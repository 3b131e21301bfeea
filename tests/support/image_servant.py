"""A servant that returns gray images that contain their number."""

from __future__ import annotations

from interfaces.jderobot import ImageData, ImageDescription, ImageFormat, ImageProvider, Time
from zenoh_ice import Current

__all__ = ["ImageI", "image"]


_REST = bytes(range(256)) * 400  # enough to go through shared memory


def image(number: int = 0, pixels: bytes = b"") -> ImageData:
    """Return an image whose time in s, and first pixel if none are given, are its number."""
    pixels = pixels or bytes([number % 256]) + _REST
    return ImageData(ImageDescription(len(pixels), 1, len(pixels), "GRAY8"), Time(number, 0), pixels)


class ImageI(ImageProvider):
    def getImageDescription(self, current: Current) -> ImageDescription:
        return image().description

    def getImageFormat(self, current: Current) -> ImageFormat:
        return ["GRAY8"]

    def getImageData(self, format: str, current: Current) -> ImageData:
        return image()
