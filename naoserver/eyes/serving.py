"""Serve what a robot's pictures show: what `nao eyes` does."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from functools import partial
from typing import Final

from interfaces.jderobot import (
    CameraDescription,
    CameraPrx,
    ConfigurationNotExistException,
    FloorPoint,
    ImageData,
)
from interfaces.nao import SafetyPrx
from naoserver.bodies.capabilities import SightReading
from naoserver.eyes._pictures import PictureEyes
from naoserver.eyes.looks import EyesError, Looks
from naoserver.serving._sight import SightI
from naoserver.soccer_field import Field
from zenoh_ice import (
    Communicator,
    ConnectionLostException,
    ObjectNotExistException,
    TimeoutException,
    initialize,
)
from zenoh_ice.application.cli import report_ready, stop_on_signals
from zenoh_ice.application.patience import Patience
from zenoh_ice.settings import Settings

IDENTITY: Final = "Sight"
_RETRY: Final = 0.2  # s between two looks for a robot that is gone
_OLDEST: Final = 1.0  # s after which a camera is asked why it sends no picture
_LOST: Final = (ConnectionLostException, ObjectNotExistException, TimeoutException)

_logger = logging.getLogger(__name__)


class _Followed:
    """A camera whose pictures come as a stream."""

    def __init__(self, camera: CameraPrx) -> None:
        self._camera = camera
        self.getCameraDescription: Final[Callable[[], CameraDescription]] = camera.getCameraDescription
        self.getFloorPoint: Final[Callable[[float, float, float], FloorPoint]] = camera.getFloorPoint

    def getImageData(self, format: str) -> ImageData:
        """Return the newest picture; without one, the call brings it, or says why there is none."""
        sample = self._camera.getImageData.latest()
        fresh = sample is not None and sample.age < _OLDEST
        return sample.value if sample is not None and fresh else self._camera.getImageData(format)


class _Newest:
    """What was seen last. Implements `capabilities.Eyes`."""

    reading = SightReading(0.0)

    def __init__(self, field: Field) -> None:
        self.field: Final = field

    def look(self) -> SightReading:
        """Return it."""
        return self.reading


def serve_eyes(settings: Settings, looks: Looks, *, rate: float, wait: float) -> None:
    """Serve `Sight` in a robot's realm until a signal comes, of at most `rate` looks a second.

    A robot is waited for, `wait` s at the start, and forever once it was there. Raises EyesError where
    Sight is served already, or there is no camera, and the exceptions of a call.
    """
    patience = Patience(wait)
    with (
        patience.until_served(partial(initialize, settings)) as communicator,
        stop_on_signals() as stop,
    ):
        cameras = patience.until_served(partial(_cameras, communicator))
        adapter = communicator.createObjectAdapter("Eyes")
        newest = _Newest(looks.soccer)
        servant = SightI(newest)
        adapter.add(servant, IDENTITY)
        adapter.activate()
        report_ready(f"ready: {IDENTITY} in realm {communicator.realm}, of {', '.join(cameras)}")
        while not stop.is_set():
            try:
                _see(PictureEyes(cameras, looks), newest, servant, stop, 1.0 / rate)
            except _LOST as error:
                _logger.warning("lost the robot; waiting for it: %s", error)
                cameras = _wait_for_cameras(communicator, stop)


def _see(eyes: PictureEyes, newest: _Newest, servant: SightI, stop: threading.Event, period: float) -> None:
    while not stop.wait(period):
        reading = eyes.look()
        if reading is not newest.reading:
            newest.reading = reading
            servant.stream.publish(reading)


def _wait_for_cameras(communicator: Communicator, stop: threading.Event) -> dict[str, _Followed]:
    """Return the cameras of a robot once it is back; none if the command is to end before."""
    while not stop.wait(_RETRY):
        try:
            cameras = _cameras(communicator)
        except _LOST:
            continue
        _logger.warning("the robot is back, with %s", ", ".join(cameras))
        return cameras
    return {}


def _cameras(communicator: Communicator) -> dict[str, _Followed]:
    """Return the cameras on the robot of the realm, by their identities.

    Raises EyesError where they are of no use, and the exceptions of a call when there is no robot.
    """
    SafetyPrx.checkedCast(communicator.stringToProxy("Safety"))  # where it is, all of the robot is known
    kind, found = CameraPrx.ice_interface.type_id, {}
    for info in communicator.servants():
        if info.identity == IDENTITY and info.server != communicator.client_id:
            raise EyesError(
                f"realm {communicator.realm!r} has a servant {IDENTITY} already: a simulation serves its own,"
                " unless it is started as naoserver-sim --no-sight"
            )
        if kind in info.interfaces:
            camera = CameraPrx.uncheckedCast(communicator.stringToProxy(info.identity))
            try:
                camera.getFloorPoint(0.0, 0.0, 0.0)
            except ConfigurationNotExistException:
                continue  # it is beside the robot
            found[info.identity] = _Followed(camera)
    if not found:
        raise EyesError(f"the robot of realm {communicator.realm!r} has no camera to see with")
    return dict(sorted(found.items()))
