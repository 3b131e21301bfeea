"""Save an image of a camera as a file."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any, Final

import typer
from rich.filesize import decimal

from nao_tools import NaoError
from nao_tools._connection import find_servant
from nao_tools._dynamic import DynamicProxy
from nao_tools._output import print_json
from zenoh_ice import initialize
from zenoh_ice.data.interface import RETURN_VALUE
from zenoh_ice.settings import Settings

# The pixel format that a camera is asked for, by the ending of the file.
_FORMATS: Final = {".png": "RGB8", ".ppm": "RGB8", ".jpg": "JPEG", ".jpeg": "JPEG"}
_MEMBERS: Final = {"description", "pixelData"}
_COMPRESSION: Final = 6


def save_image(settings: Settings, camera: str, file: Path | None, *, as_json: bool) -> None:
    """Take an image with a camera and write it to a file, by default `Camera.png`.

    Raises NaoError for an ending without a known format, when the servant is not a camera, or when the file
    cannot be written, and the exceptions of the call.
    """
    path = file or Path(f"{camera.replace('/', '_')}.png")
    pixel_format = _FORMATS.get(path.suffix.lower())
    if pixel_format is None:
        raise NaoError(f"{path}: unknown image format: use one of {', '.join(_FORMATS)}")
    with initialize(settings) as communicator:
        proxy = find_servant(communicator, camera)
        operation = image_operation(proxy)
        if operation is None:
            raise NaoError(f"{camera} is a {proxy.type_id}, which provides no images; see `nao list Camera`")
        image: Any = proxy.invoke(operation, [pixel_format])[RETURN_VALUE]
    try:
        shape, stamp = image.description, getattr(image, "timeStamp", None)
        size = shape.width, shape.height
        taken = None if stamp is None else stamp.seconds + stamp.useconds * 1e-6
        data = _encode(*size, shape.format, image.pixelData, path.suffix.lower())
    except (AttributeError, TypeError) as error:
        raise NaoError(f"{operation} returned no image that can be saved: {error}") from error
    try:
        path.write_bytes(data)
    except OSError as error:
        raise NaoError(f"cannot write {path}: {error.strerror}") from error
    if as_json:
        figures = {"width": size[0], "height": size[1], "bytes": len(data), "time": taken}
        print_json({"file": str(path), **figures})
        return
    when = "" if taken is None else f", taken at robot time {taken:.3f} s"
    typer.echo(f"wrote {path}: {size[0]}x{size[1]}, {decimal(len(data))}{when}")


def image_operation(proxy: DynamicProxy) -> str | None:
    """Return the operation that gives images: of a format by name, returning pixel data and its shape."""
    for operation in proxy.interface_operations.values():
        returned = next((each.type for each in operation.results if each.name == RETURN_VALUE), "")
        is_record = proxy.schema.kind(returned) in {"struct", "class"}
        members = {each.name for each in proxy.schema.members(returned)} if is_record else set()
        if members >= _MEMBERS and len(operation.parameters) == 1:
            return operation.name
    return None


def _encode(width: int, height: int, pixel_format: str, data: bytes, suffix: str) -> bytes:
    if pixel_format == "JPEG":
        return data
    if pixel_format != "RGB8" or width <= 0 or height <= 0 or len(data) != 3 * width * height:
        raise NaoError(
            f"the camera returned {len(data)} bytes of {pixel_format}, not an image of {width}x{height}"
        )
    return b"P6 %d %d 255\n" % (width, height) + data if suffix == ".ppm" else png(width, height, data)


def png(width: int, height: int, rgb: bytes) -> bytes:
    """Return rows of red, green and blue bytes as a PNG file (W3C PNG, 8 bits a channel, no filters)."""
    stride = 3 * width
    rows = b"".join(b"\0" + rgb[row * stride : (row + 1) * stride] for row in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, _COMPRESSION)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
