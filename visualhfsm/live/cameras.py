"""Show the robot's cameras as JPEG: the newest image, encoded once however many look at it."""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
from collections.abc import AsyncGenerator
from typing import Final

from interfaces.jderobot import CameraPrx, ImageData
from visualhfsm.errors import MissingPackageError, VisualHfsmError
from visualhfsm.monitoring.automata import printable
from visualhfsm.monitoring.realm import has_interface
from zenoh_ice import Communicator, Sample

__all__ = ["Camera", "Cameras", "encode_jpeg"]

QUALITY: Final = 80
"""Of 1 to 95; an image of 320 x 240 takes about 12 kB."""
_LARGEST: Final = 4096
"""Most pixels of a side."""

_logger = logging.getLogger(__name__)


class Cameras:
    """The cameras of a realm; each is listened to while somebody looks at it."""

    def __init__(self, communicator: Communicator, quality: int = QUALITY) -> None:
        self._communicator = communicator
        self._quality = quality
        self._open: dict[str, Camera] = {}

    async def frames(self, name: str) -> AsyncGenerator[bytes, None]:
        """Yield the newest image of a camera whenever there is a newer one; the older ones are skipped.

        Raises VisualHfsmError when there is no such camera, and MissingPackageError without Pillow.
        """
        if not has_interface(self._communicator, name, CameraPrx.ice_interface.type_id):
            raise VisualHfsmError(f"there is no camera {printable(name)[:100]}")
        _require_pillow()
        camera = self._open.get(name)
        if camera is None:
            camera = self._open[name] = Camera(self._communicator, name, self._quality)
        camera.viewers += 1
        try:
            sequence = 0
            while True:
                sequence, jpeg = await camera.next(sequence)
                yield jpeg
        finally:
            camera.viewers -= 1
            if camera.viewers == 0:
                self._open.pop(name, None)
                await asyncio.to_thread(camera.close)

    def close(self) -> None:
        """Stop listening to all of them."""
        for camera in self._open.values():
            camera.close()
        self._open.clear()


class Camera:
    """One camera that somebody looks at."""

    def __init__(self, communicator: Communicator, name: str, quality: int) -> None:
        self.viewers = 0
        self._name = name
        self._quality = quality
        self._loop = asyncio.get_running_loop()
        self._arrived = asyncio.Event()
        self._newest: ImageData | None = None
        self._number = 0
        self._encoded = (0, b"")
        self._encoding = asyncio.Lock()
        self._proxy = CameraPrx.uncheckedCast(communicator.stringToProxy(name))
        self._subscription = self._proxy.getImageData.subscribe(self._on_image)

    async def next(self, after: int) -> tuple[int, bytes]:
        """Wait for an image newer than number `after`; return its number and its JPEG."""
        while True:
            while self._number <= after:
                await self._arrived.wait()
            async with self._encoding:
                number, image = self._number, self._newest
                assert image is not None, "there is one when there is a number"
                if self._encoded[0] == number:
                    return self._encoded
                try:
                    self._encoded = number, await asyncio.to_thread(encode_jpeg, image, self._quality)
                except VisualHfsmError as error:
                    _logger.warning("%s: %s", self._name, error)
                    after = number
                else:
                    return self._encoded

    def close(self) -> None:
        """Stop listening."""
        self._subscription.close()

    def _on_image(self, sample: Sample[ImageData]) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._take, sample.value)

    def _take(self, image: ImageData) -> None:
        self._newest = image
        self._number += 1
        arrived, self._arrived = self._arrived, asyncio.Event()
        arrived.set()


def encode_jpeg(image: ImageData, quality: int = QUALITY) -> bytes:
    """Return an RGB8 image as JPEG; raises VisualHfsmError when its size does not fit its pixels."""
    from PIL import Image

    width, height = image.description.width, image.description.height
    if not (0 < width <= _LARGEST and 0 < height <= _LARGEST) or len(image.pixelData) != width * height * 3:
        raise VisualHfsmError(
            f"an image of {width} x {height} has {len(image.pixelData)} bytes, not 3 for each pixel"
        )
    buffer = io.BytesIO()
    Image.frombuffer("RGB", (width, height), image.pixelData, "raw", "RGB", 0, 1).save(
        buffer, "JPEG", quality=quality
    )
    return buffer.getvalue()


def _require_pillow() -> None:
    try:
        import PIL.Image  # noqa: F401
    except ModuleNotFoundError as error:
        raise MissingPackageError("Pillow", "web") from error
