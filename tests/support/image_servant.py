"""A servant that returns gray images that contain their number, and how its stream reaches its readers."""

from __future__ import annotations

import zenoh

from interfaces.jderobot import (
    ImageData,
    ImageDescription,
    ImageFormat,
    ImageProvider,
    ImageProviderPrx,
    Time,
)
from tests.support.stranger import session_of
from tests.support.waiting import until
from zenoh_ice import Communicator, Current

__all__ = ["ImageI", "Network", "camera", "image"]


_REST = bytes(range(256)) * 400  # enough to go through lent memory


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


def camera(client: Communicator) -> ImageProviderPrx:
    """Return a proxy to the servant `Camera`."""
    return ImageProviderPrx.checkedCast(client.stringToProxy("Camera"))


class Network:
    """Whether anybody listens to the images of a server's `Camera` over the network."""

    def __init__(self, server: Communicator) -> None:
        self._publisher: zenoh.Publisher = session_of(server).declare_publisher("nao/Camera/getImageData")

    @property
    def is_used(self) -> bool:
        return bool(self._publisher.matching_status.matching)  # type: ignore[attr-defined]

    def wait_until_unused(self, servant: ImageI) -> None:
        """Wait until there are listeners, and all of them listen through the door."""
        until(lambda: servant.getImageDataPublisher.listening and not self.is_used)
