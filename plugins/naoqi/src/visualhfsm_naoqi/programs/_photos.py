"""ALPhotoCapture: photos on the robot's disk, which is represented by a folder."""

from __future__ import annotations

import io
from pathlib import Path, PurePosixPath
from typing import Final

from naoserver.errors import InvalidCommand
from visualhfsm_naoqi._names import IMAGE_SIZES
from visualhfsm_naoqi.programs._access import Access, Service
from visualhfsm_naoqi.programs._arguments import (
    Check,
    Operation,
    chosen,
    kept,
    number_within,
    switch,
    text,
    within,
)
from visualhfsm_naoqi.programs._clients import Call
from visualhfsm_naoqi.programs._sound import path_on
from visualhfsm_naoqi.programs._video import CAMERAS, COLOR_SPACES, Pixels, shrunk, source_size

MOST_PHOTOS: Final = 100
"""Maximum photos of a call, and maximum files of photos on the disk."""
_FORMATS: Final = {
    **dict.fromkeys(("jpg", "jpeg", "jpe"), "JPEG"),
    **dict.fromkeys(("bmp", "dib"), "BMP"),
    **dict.fromkeys(("pbm", "pgm", "ppm"), "PPM"),
    **dict.fromkeys(("tif", "tiff"), "TIFF"),
    "png": "PNG",
}
"""Pillow's name of each format."""


def _number(numbers: range) -> Check:
    check = within(numbers[0], numbers[-1])
    return lambda value, what: round(check(value, what))


def _setting(name: str, does: str, check: Check) -> tuple[Operation, Operation]:
    """Return the operations that set and get an attribute of the service; `does` says what it is."""

    def change(self: ALPhotoCapture, value: object) -> None:
        setattr(self, name, check(value, does))

    def current(self: ALPhotoCapture) -> object:
        return getattr(self, name)

    change.__doc__, current.__doc__ = f"Set the {does}.", f"Return the {does}."
    return change, current


class ALPhotoCapture(Service):
    """Take photos, and write them into files."""

    _camera, _resolution, _interval, _format = 0, 2, 200, "jpg"

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._made: set[Path] = set()

    setCameraID, getCameraID = _setting("_camera", "number of the camera", _number(range(len(CAMERAS))))
    setResolution, getResolution = _setting("_resolution", "resolution", _number(range(len(IMAGE_SIZES))))
    setCaptureInterval, getCaptureInterval = _setting(
        "_interval", "time between two photos in ms", _number(range(60_001))
    )
    setPictureFormat, getPictureFormat = _setting(
        "_format",
        "format, which is the end of the files' names",
        lambda value, what: chosen(value, what, _FORMATS),
    )
    setColorSpace, getColorSpace = kept(
        "the colour space", 13, colorSpace=_number(range(max(COLOR_SPACES) + 1))
    )
    setHalfPressEnabled, isHalfPressEnabled = kept("whether the camera is kept ready", False, enable=switch)

    def takePicture(
        self, call: Call, folderPath: object, fileName: object, overwrite: object = True
    ) -> list[str]:
        """Take a photo; return a list of the name of its file on the robot's disk."""
        return self.takePictures(call, 1, folderPath, fileName, overwrite)[0]

    def takePictures(
        self,
        call: Call,
        numberOfPictures: object,
        folderPath: object,
        fileName: object,
        overwrite: object = True,
    ) -> list[list[str]]:
        """Take photos, numbered from 0 if they are several; return a list of the list of their files."""
        count = int(number_within(numberOfPictures, "number of photos", 1, MOST_PHOTOS))
        folder = PurePosixPath("/", text(folderPath, "folder"))
        stem, numbers = text(fileName, "file name"), [""] if count == 1 else [f"_{i}" for i in range(count)]
        format_, interval = self._format, self._interval / 1000.0
        names = [str(folder / f"{stem}{number}.{format_}") for number in numbers]
        paths = [path_on(self._access.disk, name) for name in names]
        self._reserve(paths, overwrite=bool(overwrite))
        for number, path in enumerate(paths):
            if number and call.wait(interval):
                break
            self._write(path, self._pixels(), _FORMATS[format_])
        return [names]

    def _reserve(self, paths: list[Path], *, overwrite: bool) -> None:
        """Count files that are to be written. Raises InvalidCommand when there are too many."""
        for path in paths:
            if not overwrite and path.exists():
                raise InvalidCommand("file name", f"{path.name} exists already")
        with self._lock:
            if len(self._made.union(paths)) > MOST_PHOTOS:
                raise InvalidCommand("file name", f"{MOST_PHOTOS} photos are taken already: reuse a name")
            self._made.update(paths)

    def _pixels(self) -> Pixels:
        """Return a new picture. Raises InvalidCommand when the camera lacks the resolution."""
        cameras = [each for each in self._robot.cameras if each.name == CAMERAS[self._camera]]
        size = IMAGE_SIZES[self._resolution]
        own = source_size(cameras[0], size) if cameras else None
        if own is None:
            raise InvalidCommand("resolution", f"there is no camera with a resolution of {size[0]}x{size[1]}")
        return shrunk(self._robot.capture(cameras[0].name, *own), size)

    def _write(self, path: Path, pixels: Pixels, kind: str) -> None:
        from PIL import Image  # slow to load

        buffer = io.BytesIO()
        Image.fromarray(pixels).save(buffer, kind)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(buffer.getvalue())
        except OSError as error:
            raise InvalidCommand("file name", f"{path.name}: {error.strerror}") from None
