"""The cameras: ALVideoDevice, subscribed once each, and released whatever happens."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from msgspec import structs

from naoserver.bodies.parts import CameraFacts
from naoserver.errors import HardwareFailure
from naoserver.hardware.connection import CallFailed
from naoserver.protocol.robot import Frame
from visualhfsm_naoqi._names import IMAGE_SIZES
from visualhfsm_naoqi.robot._link import NAME, is_nao6
from visualhfsm_naoqi.robot.calls import CallConnection, CallLink, call
from zenoh_ice.data.text import sentence

_logger = logging.getLogger(__name__)

RESOLUTIONS: Final = {size: number for number, size in IMAGE_SIZES.items()}
"""NAOqi's number of each image size."""
_RGB: Final = 11
_REQUEST_PERIOD: Final = 0.004
"""Seconds between two requests for a picture that is not available yet."""
_SAME: Final = 1.5
"""Periods for which requests are repeated to get a picture newer than the last."""
_BEFORE_NAO6: Final = (1280, 960)
"""Largest picture of a NAO4 or NAO5."""
_FAREWELL: Final = 1.0


class Stamps:
    """Turn the robot's time stamps into this machine's steady time.

    The fastest of the last pictures gives the difference between the clocks. The
    error of a time is thus the transit time of that picture.
    """

    def __init__(self) -> None:
        self._offsets: deque[float] = deque(maxlen=100)

    def steady(self, stamp: float, arrival: float) -> float:
        """Return the time in s at which a picture was taken, by its stamp and its arrival."""
        self._offsets.append(arrival - stamp)
        return stamp + min(self._offsets)


@dataclass(frozen=True, slots=True)
class _Subscription:
    link: CallLink
    handle: str
    size: tuple[int, int]
    period: float


@dataclass(slots=True)
class _Camera:
    """One camera, with at most one subscription, of the newest requested size."""

    index: int
    facts: CameraFacts
    lock: threading.Lock = field(default_factory=threading.Lock)
    subscription: _Subscription | None = None
    stamps: Stamps = field(default_factory=Stamps)
    newest: float = 0.0


class NaoqiCameras:
    """Take pictures with the cameras of a robot."""

    def __init__(
        self, connection: CallConnection, now: Callable[[], float], cameras: Sequence[CameraFacts]
    ) -> None:
        self._connection = connection
        self._known = cameras
        self._now = now
        self._cameras: dict[str, _Camera] = {}
        self._closed = False

    @property
    def facts(self) -> tuple[CameraFacts, ...]:
        """Abilities of the robot's cameras; none before it was asked for them."""
        return tuple(camera.facts for camera in self._cameras.values())

    def open(self, link: CallLink) -> None:
        """Release subscriptions left by an earlier server, and find out which cameras there are."""
        try:
            call(link, "ALVideoDevice.unsubscribeAllInstances", NAME)
        except CallFailed as error:
            _logger.debug("nothing to release: %s", error)
        large = is_nao6(link)
        for index, facts in enumerate(self._known):
            if not _has_camera(link, index):
                _logger.warning("the robot has no camera %s", facts.name)
                self._cameras.pop(facts.name, None)
                continue
            camera = self._cameras.setdefault(facts.name, _Camera(index, facts))
            camera.subscription = None
            camera.facts = _facts(link, index, facts, large=large)

    def capture(self, name: str, width: int, height: int) -> Frame:
        camera = self._cameras.get(name)
        if camera is None:
            raise HardwareFailure(sentence(f"there is no camera {name!r}"))
        deadline = time.monotonic() + self._connection.limits.picture
        if not camera.lock.acquire(timeout=self._connection.limits.picture):
            raise HardwareFailure(f"{name} is busy")
        try:
            if self._closed:
                raise HardwareFailure(f"{name}: the robot is closed")
            subscription = self._subscribe(camera, (width, height))
            return self._newest(camera, subscription, deadline)
        finally:
            camera.lock.release()

    def close(self) -> None:
        """Release every camera."""
        self._closed = True
        for camera in self._cameras.values():
            with camera.lock:
                try:
                    _release(camera)
                except HardwareFailure as error:
                    _logger.warning("%s was not released: %s", camera.facts.name, error)

    def _newest(self, camera: _Camera, subscription: _Subscription, deadline: float) -> Frame:
        """Return the newest picture, if possible newer than the last one returned."""
        link, handle = subscription.link, subscription.handle
        content = time.monotonic() + _SAME * subscription.period
        while True:
            try:
                left = max(0.05, deadline - time.monotonic())
                image = call(link, "ALVideoDevice.getImageRemote", handle, timeout=left)
            except CallFailed:
                camera.subscription = None  # another program ended it: the next capture subscribes again
                raise
            arrival = self._now()
            if image is not None:
                frame = frame_of(image, camera.facts.name, subscription.size)
                if frame.time != camera.newest or time.monotonic() > content:
                    camera.newest = frame.time
                    return replace(frame, time=camera.stamps.steady(frame.time, arrival))
            if time.monotonic() + _REQUEST_PERIOD > deadline:
                raise HardwareFailure(sentence(f"{camera.facts.name} returned no image"))
            time.sleep(_REQUEST_PERIOD)

    def _subscribe(self, camera: _Camera, size: tuple[int, int]) -> _Subscription:
        link = self._connection.require()
        subscription = camera.subscription
        if subscription is not None and subscription.size == size and subscription.link is link:
            return subscription
        if size not in camera.facts.sizes:
            raise HardwareFailure(f"{camera.facts.name} has no size {size[0]}x{size[1]}")
        _release(camera)
        rate = dict(zip(camera.facts.sizes, camera.facts.rates, strict=True))[size]
        wanted = (NAME, camera.index, RESOLUTIONS[size], _RGB, round(rate))
        handle = call(link, "ALVideoDevice.subscribeCamera", *wanted, timeout=self._connection.limits.picture)
        if not handle:
            message = f"{camera.facts.name}: the robot gives no subscription for {size[0]}x{size[1]}"
            raise HardwareFailure(f"{message}; other programs may hold too many")
        camera.subscription = _Subscription(link, str(handle), size, 1.0 / rate)
        return camera.subscription


def frame_of(image: Any, camera: str, size: tuple[int, int]) -> Frame:  # noqa: ANN401
    """Return getImageRemote's answer as a frame, at the robot's own time.

    Raises HardwareFailure when it is no picture.
    """
    try:
        width, height, layers = (int(size) for size in image[:3])
        stamp = float(image[4]) + float(image[5]) / 1e6
        array = np.frombuffer(image[6], dtype=np.uint8).reshape(height, width, 3)
    except (IndexError, TypeError, ValueError) as error:
        raise HardwareFailure(f"{camera}: the reply is not an image: {error}") from None
    if (width, height) != size or layers != 3:
        message = f"{camera}: a picture of {width}x{height} with {layers} layers came"
        raise HardwareFailure(f"{message}, not {size[0]}x{size[1]} with 3")
    return Frame(camera, stamp, width, height, array)


def _release(camera: _Camera) -> None:
    subscription, camera.subscription = camera.subscription, None
    if subscription is not None and not subscription.link.lost.is_set():
        call(subscription.link, "ALVideoDevice.unsubscribe", subscription.handle, timeout=_FAREWELL)


def _has_camera(link: CallLink, index: int) -> bool:
    """Return whether the robot has a camera; a NAOqi before 2.1 has both unless it has no video at all."""
    for operation, *arguments in (("hasCamera", index), ("getActiveCamera",)):
        with suppress(CallFailed):
            return call(link, f"ALVideoDevice.{operation}", *arguments) is not False
    return False


def _facts(link: CallLink, index: int, facts: CameraFacts, *, large: bool) -> CameraFacts:
    """Return a camera's abilities: its field of view from the robot, its sizes from the generation."""
    try:
        fov = float(call(link, "ALVideoDevice.getHorizontalFOV", index))
    except (CallFailed, TypeError, ValueError):
        fov = 0.0
    if not 0.0 < fov < math.pi:
        fov = facts.horizontal_fov
    modes = {
        size: rate
        for size, rate in zip(facts.sizes, facts.rates, strict=True)
        if size in RESOLUTIONS and (large or size <= _BEFORE_NAO6)
    }
    return structs.replace(facts, horizontal_fov=fov, sizes=tuple(modes), rates=tuple(modes.values()))
