"""Eyes that see in pictures."""

from __future__ import annotations

import logging
import threading
from collections.abc import Mapping
from typing import Final, Protocol

import numpy as np

from interfaces.jderobot import CameraDescription, FloorPoint, HardwareFailedException, ImageData
from naoserver.bodies.capabilities import SeenThing, SightReading
from naoserver.bodies.sight import Array
from naoserver.eyes._balls import find_balls
from naoserver.eyes._field import find_lines
from naoserver.eyes._robots import find_robots
from naoserver.eyes._shot import Found, Grass, Shot, take
from naoserver.eyes._standing import find_standing
from naoserver.eyes._tags import find_tags
from naoserver.eyes.looks import Looks

_logger = logging.getLogger(__name__)


class PictureCamera(Protocol):
    """A camera on the robot: a CameraPrx, or what answers as one."""

    def getImageData(self, format: str) -> ImageData: ...
    def getCameraDescription(self) -> CameraDescription: ...
    def getFloorPoint(self, u: float, v: float, height: float) -> FloorPoint: ...


class PictureEyes:
    """See balls, robots, tags and a soccer field in the pictures of cameras. Implements `capabilities.Eyes`.

    Each picture is looked at once. What a camera shows whose hardware fails is not seen, and the log says
    why; the exceptions of lost calls are raised. Thread-safe.
    """

    def __init__(self, cameras: Mapping[str, PictureCamera], looks: Looks) -> None:
        self._cameras: Final = cameras
        self._looks: Final = looks
        self.field: Final = looks.soccer
        self._lock: Final = threading.Lock()
        self._seen: dict[str, SightReading] = {}
        self._failed: dict[str, str] = {}
        self._newest = SightReading(0.0)

    def look(self) -> SightReading:
        """Return what is seen in the newest pictures; the same reading while there is no other one."""
        with self._lock:
            before = dict(self._seen)
            for name, camera in self._cameras.items():
                try:
                    self._see(name, camera)
                    self._failed.pop(name, None)
                except HardwareFailedException as failure:
                    if self._failed.get(name) != (why := str(failure)):
                        _logger.warning("%s shows nothing: %s", name, why)
                    self._failed[name] = why
                    self._seen.pop(name, None)
            if self._seen != before:
                things = [thing for reading in self._seen.values() for thing in reading.things]
                things.sort(key=lambda thing: (thing.kind, -thing.certainty))
                times = [self._newest.time, *(reading.time for reading in self._seen.values())]
                self._newest = SightReading(max(times), tuple(things))
            return self._newest

    def _see(self, name: str, camera: PictureCamera) -> None:
        """Look at the picture of a camera, unless that is the one that it has seen."""
        image = camera.getImageData("RGB8")
        time = image.timeStamp.seconds + 1e-6 * image.timeStamp.useconds
        if name in self._seen and self._seen[name].time == time:
            return
        shot = take(name, image, camera.getCameraDescription(), camera.getFloorPoint, self._looks.field)
        self._seen[name] = SightReading(time, () if shot is None else see(shot, self._looks))


def see(shot: Shot, looks: Looks) -> tuple[SeenThing, ...]:
    """Return what a picture shows."""
    balls = [*find_balls(shot, looks)]
    found = [*balls, *find_tags(shot, looks)]
    if shot.grass is not None:
        found += _on_field(shot, shot.grass, looks, balls)
    return shot.place.see(
        [each.thing for each in found],
        _rows([each.middle for each in found]),
        _rows([each.base for each in found]),
    )


def _on_field(shot: Shot, grass: Grass, looks: Looks, balls: list[Found]) -> list[Found]:
    standing = find_standing(grass.green, grass.white, shot.to_floor, float(shot.eye[2]))
    free = Grass(grass.green & ~standing.hidden, grass.white & ~standing.hidden)
    robots = find_robots(shot, looks, standing.feet, _rows([ball.base for ball in balls])[:, :2])
    return [*robots, *find_lines(shot, free, looks.field.line)]


def _rows(places: list[Array]) -> Array:
    return np.array(places, np.float64).reshape(-1, 3)
