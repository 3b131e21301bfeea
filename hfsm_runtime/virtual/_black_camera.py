"""What the stand-in for a camera answers: black pictures, since code that reads one fails if it is empty."""

from __future__ import annotations

import math
from typing import Any, Final

from interfaces.jderobot import (
    CameraDescription,
    CameraPrx,
    ConfigurationNotExistException,
    FloorPoint,
    ImageData,
    ImageDescription,
    ImageProviderPrx,
)
from zenoh_ice.interface import Interface

_WIDTH: Final = 320
_HEIGHT: Final = 240
_BLACK: Final = {
    "RGB8": b"\0\0\0",
    "BGR8": b"\0\0\0",
    "GRAY8": b"\0",
    "YUV422": b"\x10\x80",
}
"""The bytes of a pixel by pixel format; the first is that of the stream."""
_STREAMED: Final = next(iter(_BLACK))


def gives_pictures(interface: Interface) -> bool:
    """Return whether an interface is that of a camera, or extends it."""
    return ImageProviderPrx.ice_interface in interface.lineage


def black_camera(identity: str, interface: Interface) -> dict[str, Any]:
    """Return what a camera that sees nothing answers, by operation; nothing for what is no camera."""
    if not gives_pictures(interface):
        return {}

    def picture(format: str) -> ImageData:
        pixel = _BLACK.get(format or _STREAMED)
        if pixel is None:
            known = ", ".join(_BLACK)
            message = f"{identity} is a stand-in, which has no format {format[:64]!r}; it has {known}"
            raise ConfigurationNotExistException(message)
        pixels = pixel * (_WIDTH * _HEIGHT)
        return ImageData(description=_shape(format or _STREAMED), pixelData=pixels)

    answers: dict[str, Any] = {
        "getImageDescription": _shape(_STREAMED),
        "getImageFormat": [*_BLACK],
        "getImageData": picture,
    }
    if CameraPrx.ice_interface in interface.lineage:
        nowhere = FloorPoint(x=math.inf, y=math.inf, distance=math.inf)
        answers |= {"getCameraDescription": _description(identity), "getFloorPoint": nowhere}
    return answers


def _shape(format: str) -> ImageDescription:
    size = len(_BLACK[format]) * _WIDTH * _HEIGHT
    return ImageDescription(width=_WIDTH, height=_HEIGHT, size=size, format=format)


def _description(identity: str) -> CameraDescription:
    return CameraDescription(
        name=identity,
        shortDescription="a stand-in, whose pictures are black",
        width=_WIDTH,
        height=_HEIGHT,
        rate=10.0,
        fdistx=_WIDTH,
        fdisty=_WIDTH,
        u0=(_WIDTH - 1) / 2,
        v0=(_HEIGHT - 1) / 2,
    )
