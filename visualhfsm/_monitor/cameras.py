"""Show the robot's cameras as JPEG: the newest image, encoded once for all viewers, and earlier ones."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import time
from collections.abc import AsyncGenerator, Iterable
from typing import Final, cast

import msgspec

from interfaces.hfsm import Mark
from interfaces.jderobot import CameraPrx, ImageData
from interfaces.nao import SightPrx
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.pictures import Pictures, encode_jpeg, require_pillow
from visualhfsm._monitor.realm.realm import has_interface
from zenoh_ice import Communicator, Sample, UserException, ZenohIceError
from zenoh_ice.data.text import printable
from zenoh_ice.objects.home import Home

KEPT_APART: Final = 1.0
"""Seconds between two images that are kept of a camera that no window shows."""
MOST_CAMERAS: Final = 8
"""Cameras of which pictures are kept, or recorded."""
_IMAGE_LIMIT: Final = 1.0
"""Seconds without an image after which the presence of the camera is checked again."""
_OLDEST_SIGHT: Final = 1.0
"""Seconds after which what was seen is not shown any more."""
_MOST_SEEN: Final = 16
"""Things that are marked on a picture."""
_LONGEST_LABEL: Final = 60
"""Characters of a mark."""
_PICTURE_LIMIT: Final = 1000
"""Milliseconds for a picture."""

_logger = logging.getLogger(__name__)


async def take_picture(communicator: Home, camera: str) -> tuple[float, bytes] | None:
    """Return the wall time and the JPEG of the present image of a camera; None when it gives none in time."""
    proxy = communicator.stringToProxy(camera).ice_invocationTimeout(_PICTURE_LIMIT)
    with contextlib.suppress(VisualHfsmError, ZenohIceError, UserException):  # the next one may succeed
        image = await asyncio.wrap_future(CameraPrx.uncheckedCast(proxy).getImageData.begin("RGB8"))
        at, shape = time.time(), image.description
        return at, await asyncio.to_thread(encode_jpeg, shape.width, shape.height, image.pixelData)
    return None


class Cameras:
    """The cameras of a realm; each is subscribed to while a window shows it."""

    def __init__(self, communicator: Communicator) -> None:
        self.former: Final = Pictures()
        """Images that were sent to a window, or kept."""
        self._communicator = communicator
        self._encoded: dict[str, tuple[tuple[int, float], asyncio.Task[bytes]]] = {}

    async def frames(self, name: str) -> AsyncGenerator[bytes | str, None]:
        """Yield the newest image of a camera whenever there is a newer one; older ones are skipped.

        Before an image comes what is seen on it, if that has changed: marks in JSON.

        Raises VisualHfsmError when there is no such camera, and MissingPackageError without Pillow.
        """
        if not has_interface(self._communicator, name, CameraPrx.ice_interface.type_id):
            raise VisualHfsmError.because("there is no camera {name}", name=printable(name)[:100])
        require_pillow()
        camera = CameraPrx.uncheckedCast(self._communicator.stringToProxy(name))
        stream, marked = camera.getImageData, "[]"
        while True:
            try:
                description = await asyncio.wrap_future(camera.getCameraDescription.begin())
                focal = description.fdistx / max(description.width, 1)
                samples = cast(
                    "AsyncGenerator[Sample[ImageData]]", aiter(stream.samples(timeout=_IMAGE_LIMIT))
                )
                async with contextlib.aclosing(samples):  # the subscription ends when no window shows it
                    async for sample in samples:
                        try:
                            jpeg = await self._encode(name, sample)
                            self.former.add(name, time.time(), jpeg)
                            if (marks := self._seen(name, sample.value, focal)) != marked:
                                marked = marks
                                yield marks
                            yield jpeg
                        except VisualHfsmError as error:
                            _logger.warning("%s: %s", name, error)
            except ZenohIceError:  # the camera is gone or sends nothing; it may come back
                await asyncio.sleep(_IMAGE_LIMIT)

    def _seen(self, name: str, image: ImageData, focal: float) -> str:
        """Return what `Sight` sees on an image, in JSON; `focal` is the focal length in widths of an image.

        Places on lines are left out: they would hide it.
        """
        sight = SightPrx.uncheckedCast(self._communicator.stringToProxy("Sight"))
        sample = sight.getSight.latest()
        things = [] if sample is None or sample.age > _OLDEST_SIGHT else sample.value.things
        width, height = image.description.width, image.description.height
        marks = [
            Mark(
                name,
                round((width - 1) / 2 - focal * width * math.tan(thing.left), 1),
                round((height - 1) / 2 + focal * width * math.tan(thing.down), 1),
                printable(f"{thing.name} {thing.kind}".strip())[:_LONGEST_LABEL],
            )
            for thing in things
            if thing.camera == name and thing.kind != "line" and max(abs(thing.left), abs(thing.down)) < 1.5
        ]
        return msgspec.json.encode(marks[:_MOST_SEEN]).decode()

    async def keep(self, names: Iterable[str]) -> None:
        """Keep the present image of each camera of which none was kept within the last second."""
        for name in names:
            if self.former.due(name, time.time(), KEPT_APART):
                picture = await take_picture(self._communicator, name)
                if picture is not None:
                    self.former.add(name, *picture)

    async def _encode(self, name: str, sample: Sample[ImageData]) -> bytes:
        which = sample.sequence, sample.wall_time
        if name not in self._encoded or self._encoded[name][0] != which:
            image, shape = sample.value, sample.value.description
            work = asyncio.to_thread(encode_jpeg, shape.width, shape.height, image.pixelData)
            self._encoded[name] = which, asyncio.create_task(work)
        return await asyncio.shield(self._encoded[name][1])
