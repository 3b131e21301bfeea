"""Save what a camera sees as a file."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from deploy.nao import NaoError, UsageError
from deploy.nao.connection import find_servant
from deploy.nao.dynamic import DynamicProxy
from deploy.nao.output import print_json, print_line
from deploy.nao.quantities import bytes_text
from deploy.nao.values import Json
from zenoh_ice import initialize
from zenoh_ice.reflection import RETURN_VALUE
from zenoh_ice.settings import Settings

__all__ = ["image_operation", "png", "save_image"]

_FORMATS: Final = {".png": "RGB8", ".ppm": "RGB8", ".jpg": "JPEG", ".jpeg": "JPEG"}
"""The pixel format that a camera is asked for, by the ending of the file."""

_MEMBERS: Final = {"description", "pixelData"}
_COMPRESSION: Final = 6


@dataclass(frozen=True, slots=True)
class _Image:
    width: int
    height: int
    format: str
    data: bytes
    time: float | None


def save_image(settings: Settings, camera: str, file: Path | None, *, as_json: bool) -> None:
    """Take an image with a camera and write it to a file, by default `Camera.png`.

    Raises UsageError for an ending that stands for no format, NaoError when the servant is no camera or the
    file cannot be written, and whatever the call raises.
    """
    path = file or Path(f"{camera.replace('/', '_')}.png")
    pixel_format = _FORMATS.get(path.suffix.lower())
    if pixel_format is None:
        raise UsageError(f"{path}: the ending says the format: write one of {', '.join(_FORMATS)}")
    with initialize(settings) as communicator:
        proxy = find_servant(communicator, camera)
        operation = image_operation(proxy)
        if operation is None:
            raise NaoError(
                f"{camera} is a {proxy.type_id}, which gives no images; `nao list Camera` shows who does"
            )
        image = _take(proxy, operation, pixel_format)
    data = _encode(image, path)
    try:
        path.write_bytes(data)
    except OSError as error:
        raise NaoError(f"cannot write {path}: {error.strerror}") from error
    if as_json:
        size: dict[str, Json] = {"width": image.width, "height": image.height, "bytes": len(data)}
        print_json({"file": str(path), **size, "time": image.time})
        return
    taken = "" if image.time is None else f", taken at robot time {image.time:.3f} s"
    print_line(f"wrote {path}: {image.width}x{image.height}, {bytes_text(len(data))}{taken}")


def image_operation(proxy: DynamicProxy) -> str | None:
    """Return the operation that gives images: of a format by name, returning pixel data and its shape."""
    for operation in proxy.interface_operations.values():
        returned = next((each.type for each in operation.results if each.name == RETURN_VALUE), "")
        is_record = proxy.schema.kind(returned) in {"struct", "class"}
        members = {each.name for each in proxy.schema.members(returned)} if is_record else set()
        if members >= _MEMBERS and len(operation.parameters) == 1:
            return operation.name
    return None


def _take(proxy: DynamicProxy, operation: str, pixel_format: str) -> _Image:
    value: Any = proxy.invoke(operation, [pixel_format])[RETURN_VALUE]
    try:
        shape, stamp = value.description, getattr(value, "timeStamp", None)
        taken = None if stamp is None else stamp.seconds + stamp.useconds * 1e-6
        return _Image(shape.width, shape.height, shape.format, value.pixelData, taken)
    except (AttributeError, TypeError) as error:
        raise NaoError(f"{operation} gives no image that can be saved: {error}") from error


def _encode(image: _Image, path: Path) -> bytes:
    """Return the contents of the file."""
    if image.format == "JPEG":
        return image.data
    width, height = image.width, image.height
    if image.format != "RGB8" or width <= 0 or height <= 0 or len(image.data) != 3 * width * height:
        raise NaoError(
            f"the camera gave {len(image.data)} bytes of {image.format} that are no image of {width}x{height}"
        )
    if path.suffix.lower() == ".ppm":
        return b"P6 %d %d 255\n" % (width, height) + image.data
    return png(width, height, image.data)


def png(width: int, height: int, rgb: bytes) -> bytes:
    """Return rows of red, green and blue bytes as a PNG file (W3C PNG, 8 bits a channel, no filters)."""
    stride = 3 * width
    rows = b"".join(b"\0" + rgb[row * stride : (row + 1) * stride] for row in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, _COMPRESSION)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
