"""Show the robot's cameras as JPEG: the newest image, encoded once however many look at it."""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
from collections.abc import AsyncGenerator
from typing import Final, cast

from interfaces.jderobot import CameraPrx, ImageData
from visualhfsm.errors import MissingPackageError, VisualHfsmError
from visualhfsm.monitoring.realm import has_interface
from zenoh_ice import Communicator, Sample, ZenohIceError
from zenoh_ice.text import printable

__all__ = ["Cameras", "encode_jpeg"]

QUALITY: Final = 80
"""Of 1 to 95; an image of 320 x 240 takes about 12 kB."""
_LARGEST: Final = 4096
"""Most pixels of a side."""
_PATIENCE: Final = 1.0
"""Seconds without an image after which the presence of the camera is checked again."""

_logger = logging.getLogger(__name__)


class Cameras:
    """The cameras of a realm; each is subscribed to while a window shows it."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator = communicator
        self._encoded: dict[str, tuple[tuple[int, float], asyncio.Task[bytes]]] = {}

    async def frames(self, name: str) -> AsyncGenerator[bytes, None]:
        """Yield the newest image of a camera whenever there is a newer one; older ones are skipped.

        Raises VisualHfsmError when there is no such camera, and MissingPackageError without Pillow.
        """
        if not has_interface(self._communicator, name, CameraPrx.ice_interface.type_id):
            raise VisualHfsmError(f"there is no camera {printable(name)[:100]}")
        _require_pillow()
        stream = CameraPrx.uncheckedCast(self._communicator.stringToProxy(name)).getImageData
        while True:
            try:
                samples = cast("AsyncGenerator[Sample[ImageData]]", aiter(stream.samples(timeout=_PATIENCE)))
                async with contextlib.aclosing(samples):  # the subscription ends when no window shows it
                    async for sample in samples:
                        try:
                            yield await self._encode(name, sample)
                        except VisualHfsmError as error:
                            _logger.warning("%s: %s", name, error)
            except ZenohIceError:  # it is gone, or sends nothing: it may come back
                await asyncio.sleep(_PATIENCE)

    async def _encode(self, name: str, sample: Sample[ImageData]) -> bytes:
        which = sample.sequence, sample.wall_time
        if name not in self._encoded or self._encoded[name][0] != which:
            work = asyncio.to_thread(encode_jpeg, sample.value)
            self._encoded[name] = which, asyncio.create_task(work)
        return await asyncio.shield(self._encoded[name][1])


def encode_jpeg(image: ImageData) -> bytes:
    """Return an RGB8 image as JPEG; raises VisualHfsmError when its size does not fit its pixels."""
    from PIL import Image

    width, height = image.description.width, image.description.height
    if not (0 < width <= _LARGEST and 0 < height <= _LARGEST) or len(image.pixelData) != width * height * 3:
        raise VisualHfsmError(
            f"an image of {width} x {height} has {len(image.pixelData)} bytes, not 3 for each pixel"
        )
    buffer = io.BytesIO()
    Image.frombuffer("RGB", (width, height), image.pixelData, "raw", "RGB", 0, 1).save(
        buffer, "JPEG", quality=QUALITY
    )
    return buffer.getvalue()


def _require_pillow() -> None:
    try:
        import PIL.Image  # noqa: F401
    except ModuleNotFoundError as error:
        raise MissingPackageError("Pillow", "web") from error
