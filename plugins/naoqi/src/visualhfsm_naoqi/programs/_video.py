"""ALVideoDevice: the cameras."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Mapping
from itertools import count
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.parts import CameraFacts
from naoserver.errors import InvalidCommand
from naoserver.protocol.robot import Frame
from naoserver.serving.camera import PIXEL_FORMATS
from visualhfsm_naoqi._names import IMAGE_SIZES
from visualhfsm_naoqi.programs._access import Access, Service
from visualhfsm_naoqi.programs._arguments import kept, number, number_within, text, vector, within
from visualhfsm_naoqi.programs._clients import Belongings, Call

_logger = logging.getLogger(__name__)

MOST_OF_A_NAME: Final = 8
"""Maximum subscriptions of one name, as in NAOqi."""
MOST_SUBSCRIPTIONS: Final = 16
"""Maximum subscriptions of a client."""
_SELECT: Final = 18
"""NAOqi's parameter that chooses the camera."""
CAMERAS: Final = ("Camera", "CameraBottom")
"""The cameras by NAOqi's number: top and bottom."""

Picture = tuple[int, int, int, int, int, int, bytes, int, float, float, float, float]
"""Width, height, layers, colour space, s, us, bytes, camera, angles of left, top, right and bottom."""
# Bytes that are not declared as raw arrive mangled, as text.
SIGNATURE: Final = "(iiiiiiriffff)"

Pixels = NDArray[np.uint8]


def _yuv(rgb: Pixels) -> bytes:
    """Return Y U V of each pixel; two neighbors share both chroma values."""
    height, width = rgb.shape[:2]
    pairs = np.frombuffer(PIXEL_FORMATS["YUV422"](rgb), np.uint8).reshape(height, width // 2, 4)
    yuv = np.empty((height, width, 3), np.uint8)
    yuv[:, :, 0] = pairs[:, :, 0::2].reshape(height, width)
    yuv[:, :, 1] = pairs[:, :, 1].repeat(2, axis=1)
    yuv[:, :, 2] = pairs[:, :, 3].repeat(2, axis=1)
    return yuv.tobytes()


COLOR_SPACES: Final[Mapping[int, Callable[[Pixels], bytes]]] = {
    0: PIXEL_FORMATS["GRAY8"],
    9: PIXEL_FORMATS["YUV422"],
    10: _yuv,
    11: PIXEL_FORMATS["RGB8"],
    13: PIXEL_FORMATS["BGR8"],
}
"""Converters of an RGB picture to a colour space's bytes, by NAOqi's number: Y, YUV422, YUV, RGB, BGR."""
LAYERS: Final[Mapping[int, int]] = {0: 1, 9: 2, 10: 3, 11: 3, 13: 3}
"""Bytes per pixel of each colour space."""


def source_size(facts: CameraFacts, size: tuple[int, int]) -> tuple[int, int] | None:
    """Return the size that a camera uses for pictures of `size`: that or a multiple; None if impossible."""
    fitting = (own for own in facts.sizes if own[0] % size[0] == 0 and own[1] * size[0] == own[0] * size[1])
    return min(fitting, default=None)


def shrunk(frame: Frame, size: tuple[int, int]) -> Pixels:
    """Return the pixels of a frame in a size that divides its own: each is the mean of a block of pixels."""
    factor = frame.width // size[0]
    if factor == 1:
        return frame.pixels
    blocks = frame.pixels.reshape(size[1], factor, size[0], factor, 3)
    means: Pixels = blocks.mean(axis=(1, 3)).astype(np.uint8)
    return means


class _Subscription(NamedTuple):
    camera: int
    resolution: int
    color_space: int
    rate: float


def _setting(field: str) -> tuple[Callable[..., int], Callable[..., bool]]:
    """Return the operations that get and set a field of a subscription."""

    def get(self: ALVideoDevice, handle: object) -> int:
        """Return this number of a subscription."""
        value: float = getattr(self._get(handle), field)
        return round(value)

    def change(self: ALVideoDevice, handle: object, value: object) -> bool:
        """Change this number of a subscription; returns whether the camera can do that."""
        before = self._get(handle)
        try:
            after = self._checked(**{**before._asdict(), field: value})
        except InvalidCommand as error:
            _logger.warning("ALVideoDevice: %s", error)
            return False
        with self._lock:
            self._subscriptions.change(str(handle), after)
        return True

    return get, change


class ALVideoDevice(Service):
    """Provide pictures to subscribers. None is taken unless one is requested."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._cameras = [each for name in CAMERAS for each in self._robot.cameras if each.name == name]
        self._subscriptions: Belongings[str, _Subscription] = self._bounded(
            "subscriptions of cameras", MOST_SUBSCRIPTIONS
        )
        self._counter = count()
        self._active = 0
        self._taking = {facts.name: threading.Lock() for facts in self._cameras}
        # The newest frame by camera and size, and the time of its request.
        self._newest: dict[tuple[str, int, int], tuple[float, Frame]] = {}

    def subscribeCamera(
        self, name: object, cameraIndex: object, resolution: object, colorSpace: object, fps: object
    ) -> str:
        """Return a handle for pictures of a camera; an empty one when it is not available: see the log."""
        try:
            subscription = self._checked(cameraIndex, resolution, colorSpace, fps)
            owner = text(name, "name")
            with self._lock:
                if len(self._of(owner)) >= MOST_OF_A_NAME:
                    raise InvalidCommand("name", f"{owner[:60]!r} has too many subscriptions: unsubscribe")
                handle = f"{owner}_{next(self._counter)}"
                self._subscriptions[handle] = subscription
        except InvalidCommand as error:
            _logger.warning("ALVideoDevice::subscribeCamera: %s", error)
            return ""
        return handle

    def subscribe(self, name: object, resolution: object, colorSpace: object, fps: object) -> str:
        """Return a handle for pictures of the active camera, at first the top one."""
        return self.subscribeCamera(name, self._active, resolution, colorSpace, fps)

    def unsubscribe(self, handle: object) -> bool:
        """End a subscription; returns whether there was one."""
        with self._lock:
            return self._subscriptions.pop(text(handle, "handle"), None) is not None

    def unsubscribeAllInstances(self, name: object) -> bool:
        """End every subscription of a name; returns whether there was one."""
        with self._lock:
            handles = self._of(text(name, "name"))
            for handle in handles:
                del self._subscriptions[handle]
        return bool(handles)

    def getSubscribers(self) -> list[str]:
        """Return the handles of all subscriptions."""
        with self._lock:
            return list(self._subscriptions)

    def getImageRemote(self, call: Call, handle: object) -> Picture | None:  # noqa: ARG002 - it may take long
        """Return the newest picture, at most as old as the period of the subscription."""
        subscription = self._get(handle)
        size, space = IMAGE_SIZES[subscription.resolution], subscription.color_space
        facts = self._cameras[subscription.camera]
        frame = self._frame(facts, size, subscription.rate)
        pixels = COLOR_SPACES[space](shrunk(frame, size))
        seconds, fraction = divmod(frame.time, 1.0)
        right = facts.horizontal_fov / 2
        bottom = math.atan(math.tan(right) * size[1] / size[0])
        angles = (right, bottom, -right, -bottom)
        stamp = int(seconds), int(fraction * 1e6)
        return *size, LAYERS[space], space, *stamp, pixels, subscription.camera, *angles

    getImageRemote.__qi_return_signature__ = SIGNATURE  # type: ignore[attr-defined]

    def releaseImage(self, handle: object) -> bool:
        """Do nothing, since every picture is a copy; return whether the subscription exists."""
        with self._lock:
            return isinstance(handle, str) and handle in self._subscriptions

    _change_camera = _setting("camera")[1]

    def getActiveCamera(self, *handle: object) -> int:
        """Return the number of the camera of a subscription, or of `subscribe` without one."""
        return self._get(handle[0]).camera if handle else self._active

    def setActiveCamera(self, *handle_and_camera: object) -> bool:
        """Choose the camera of a subscription, or of all with the active one; returns whether it is there."""
        *handle, camera = handle_and_camera or (None,)
        if handle:
            return self._change_camera(handle[0], camera)
        if not isinstance(camera, int) or not self.hasCamera(camera):
            return False
        before, self._active = self._active, camera
        shown = [each for each in self.getSubscribers() if self._get(each).camera == before]
        return all(self._change_camera(each, camera) for each in shown)

    def setAllParametersToDefault(self, cameraIndex: object) -> bool:
        """Reset the parameters of a camera."""
        self._camera(cameraIndex)
        for key in [key for key in self.kept.copy() if key[1] == cameraIndex]:
            self.kept.pop(key, None)
        return True

    def setParam(self, parameter: object, value: object) -> bool:
        """Remember a parameter of the active camera, which has no effect; number 18 chooses that camera."""
        if parameter == _SELECT:
            return self.setActiveCamera(value)
        self.setParameter(self._active, parameter, value)
        return True

    def getParam(self, parameter: object) -> int:
        """Return a parameter of the active camera, and with number 18 the camera."""
        return self._active if parameter == _SELECT else self.getParameter(self._active, parameter)

    setParameter, getParameter = kept(
        "a parameter of a camera, such as its brightness",
        0,
        result=True,
        cameraIndex=within(0, len(CAMERAS) - 1),
        parameter=within(0, 100),
        value=lambda value, what: round(number(value, what)),
    )

    def openCamera(self, cameraIndex: object) -> bool:
        """Return whether there is a camera of a number: cameras are always open."""
        return self.hasCamera(cameraIndex)

    closeCamera = isCameraOpen = openCamera

    def setCameraParameter(self, handle: object, parameter: object, value: object) -> bool:
        """Remember a parameter of a subscription's camera, without effect; number 18 chooses that camera.

        Returns False, as a robot does, where there is no such subscription: see the log.
        """
        try:
            camera = self._get(handle).camera
        except InvalidCommand as error:
            _logger.warning("ALVideoDevice::setCameraParameter: %s", error)
            return False
        if parameter == _SELECT:
            return self._change_camera(handle, value)
        self.setParameter(camera, parameter, value)
        return True

    def getCameraParameter(self, handle: object, parameter: object) -> int:
        """Return a parameter of the camera of a subscription."""
        result: int = self.getParameter(self._get(handle).camera, parameter)
        return result

    getResolution, setResolution = _setting("resolution")
    getColorSpace, setColorSpace = _setting("color_space")
    getFrameRate, setFrameRate = _setting("rate")

    def getCameraIndexes(self) -> list[int]:
        """Return the numbers of the cameras."""
        return list(range(len(self._cameras)))

    def hasCamera(self, cameraIndex: object) -> bool:
        """Return whether there is a camera of a number."""
        return cameraIndex in range(len(self._cameras))

    def getHorizontalFOV(self, cameraIndex: object) -> float:
        """Return the horizontal field of view in rad."""
        return self._camera(cameraIndex).horizontal_fov

    def getVerticalFOV(self, cameraIndex: object) -> float:
        """Return the vertical field of view in rad of 4:3 pictures."""
        return 2.0 * math.atan(self._halves(cameraIndex)[1])

    getHorizontalAperture, getVerticalAperture = getHorizontalFOV, getVerticalFOV  # their former names

    def getAngularPositionFromImagePosition(self, cameraIndex: object, imgPos: object) -> list[float]:
        """Return the angles in rad, to the left and downwards, of a place from 0, 0 (top left) to 1, 1."""
        (x, y), (wide, high) = vector(imgPos, "imgPos", 2), self._halves(cameraIndex)
        return [math.atan((1.0 - 2.0 * x) * wide), math.atan((2.0 * y - 1.0) * high)]

    def getImagePositionFromAngularPosition(self, cameraIndex: object, angPos: object) -> list[float]:
        """Return the place from 0, 0 (top left) to 1, 1 of angles in rad to the left and downwards."""
        (left, down), (wide, high) = vector(angPos, "angPos", 2), self._halves(cameraIndex)
        return [0.5 - 0.5 * math.tan(left) / wide, 0.5 + 0.5 * math.tan(down) / high]

    def getAngularSizeFromImageSize(self, cameraIndex: object, imgSize: object) -> list[float]:
        """Return the angles in rad of a size in the middle of the picture, as parts of the picture's."""
        sizes = zip(vector(imgSize, "imgSize", 2), self._halves(cameraIndex), strict=True)
        return [2.0 * math.atan(size * half) for size, half in sizes]

    def getImageSizeFromAngularSize(self, cameraIndex: object, angSize: object) -> list[float]:
        """Return the size, as parts of the picture's, of angles in rad in the middle of the picture."""
        angles = zip(vector(angSize, "angSize", 2), self._halves(cameraIndex), strict=True)
        return [math.tan(angle / 2.0) / half for angle, half in angles]

    def getImageInfoFromAngularInfo(self, cameraIndex: object, angInfo: object) -> list[float]:
        """Return place and size in the picture of a place and a size in rad, as events have them."""
        *place, width, height = vector(angInfo, "angInfo", 4)
        found = self.getImagePositionFromAngularPosition(cameraIndex, place)
        return found + self.getImageSizeFromAngularSize(cameraIndex, [width, height])

    def getImageInfoFromAngularInfoWithResolution(
        self, cameraIndex: object, angInfo: object, resolution: object
    ) -> list[float]:
        """Return what getImageInfoFromAngularInfo does in pixels of a resolution."""
        size = IMAGE_SIZES[self._checked(cameraIndex, resolution, 0, 1.0).resolution]
        info = self.getImageInfoFromAngularInfo(cameraIndex, angInfo)
        return [part * side for part, side in zip(info, (*size, *size), strict=True)]

    def _halves(self, index: object) -> tuple[float, float]:
        """Return half the width and half the height of a picture at the distance 1, as 4:3 pictures are."""
        half = math.tan(self._camera(index).horizontal_fov / 2.0)
        return half, 0.75 * half

    def _camera(self, index: object) -> CameraFacts:
        if not isinstance(index, int) or not 0 <= index < len(self._cameras):
            raise InvalidCommand("camera", f"there is no camera {index!r}; there are {len(self._cameras)}")
        return self._cameras[index]

    def _checked(
        self, camera: object, resolution: object, color_space: object, rate: object
    ) -> _Subscription:
        facts = self._camera(camera)
        known = [number for number, size in IMAGE_SIZES.items() if source_size(facts, size)]
        if not isinstance(resolution, int) or resolution not in known:
            raise InvalidCommand("resolution", f"{facts.name} has no resolution {resolution!r}, only {known}")
        if not isinstance(color_space, int) or color_space not in COLOR_SPACES:
            raise InvalidCommand("colorSpace", f"no colour space {color_space!r}, only {[*COLOR_SPACES]}")
        index = self._cameras.index(facts)
        return _Subscription(index, resolution, color_space, number_within(rate, "fps", 1.0, 30.0))

    def _of(self, name: str) -> list[str]:
        return [handle for handle in self._subscriptions if handle.rpartition("_")[0] == name]

    def _get(self, handle: object) -> _Subscription:
        with self._lock:
            subscription = self._subscriptions.get(handle) if isinstance(handle, str) else None
        if subscription is None:
            raise InvalidCommand("handle", f"there is no subscription {str(handle)[:60]!r}")
        return subscription

    def _frame(self, facts: CameraFacts, wanted: tuple[int, int], rate: float) -> Frame:
        """Return the newest frame; take a new one if a period has begun since."""
        size = source_size(facts, wanted)
        assert size is not None
        key = (facts.name, *size)
        with self._taking[facts.name]:
            now = self._robot.clock.now()
            asked, newest = self._newest.pop(key, (-math.inf, None))
            # By periods, not by age: a frequent caller gets every picture, however long one takes.
            if newest is None or math.floor(asked * rate) != math.floor(now * rate):
                asked, newest = now, self._robot.capture(facts.name, *size)
            self._newest[key] = asked, newest
            return newest
