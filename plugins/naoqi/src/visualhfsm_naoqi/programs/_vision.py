"""NAOqi's detectors of red balls, landmarks, faces and blobs of a color.

Red balls are those that `Sight` reports. The others are found in the robot's own pictures: their events have
sizes, which `Sight` does not know. Landmarks are ArUco marks of 4 by 4 bits, whose numbers are reported.
World files place them, and faces, as signs.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from interfaces import nao
from naoserver.bodies.kinematics import numbers_of
from naoserver.bodies.parts import CameraFacts
from naoserver.errors import HardwareFailure, RobotError
from naoserver.eyes.looks import read_looks
from visualhfsm_naoqi.programs._access import Access
from visualhfsm_naoqi.programs._arguments import constant, kept, number, number_within, switch, text
from visualhfsm_naoqi.programs._clients import Call
from visualhfsm_naoqi.programs._memory import ALMemory
from visualhfsm_naoqi.programs._sensors import Extractor
from zenoh_ice.application import missing_package

_logger = logging.getLogger(__name__)

LOOKING: Final = 0.1
"""Robot seconds between two detections."""
_SIZE: Final = (320, 240)
_CAMERAS: Final = ("CameraTop", "CameraBottom")
_MOST_SEEN: Final = 10
_SMALLEST: Final = 20
"""Pixels of the smallest region that is detected."""
_FORGETTING: Final = 4.0
"""Robot seconds without a face after which a person counts as met again."""
_MOST_LEARNED: Final = 100

Pixels = NDArray[np.uint8]
Region = tuple[float, float, float, float]
"""Center (to the right and down), width and height, in pixels."""
Detection = tuple[Region, Any]
"""A region and further data."""


_MIDDLE: Final = 0.5
"""From what OpenCV counts, the middles of pixels, to where they are in the picture, in pixels."""
_BEYOND: Final = 0.35
"""Pixels by which a landmark reaches beyond its corners: 0.5 where it is upright and crisp. With this, one of
9 cm in MuJoCo's pictures is as wide as it should be within 1 %, from 0.5 to 2 m."""


def find_blob(picture: Pixels, color: tuple[int, int, int], tolerance: int) -> Region | None:
    """Return the largest region of an RGB picture whose color differs by at most `tolerance` in each part."""
    import cv2

    near = np.abs(picture.astype(np.int16) - color).max(axis=2) <= tolerance
    for contour in _contours(near.astype(np.uint8)):
        left, top, width, height = cv2.boundingRect(contour)
        return _region(left, top, left + width, top + height)
    return None


def find_landmarks(picture: Pixels) -> list[tuple[int, Region]]:
    """Return number and region of the landmarks in an RGB picture, by number."""
    import cv2

    marks = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250))
    corners, numbers, _ = marks.detectMarkers(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY))
    places = (corner[0] + _MIDDLE for corner in corners)  # of the middles of its outermost black pixels
    found = zip([] if numbers is None else numbers.ravel(), places, strict=True)
    return sorted(
        (int(mark), _region(*(edges.min(axis=0) - _BEYOND), *(edges.max(axis=0) + _BEYOND)))
        for mark, edges in found
    )


def find_faces(picture: Pixels) -> list[Region]:
    """Return the regions of an RGB picture that look like a face: skin, and two dark eyes side by side."""
    import cv2

    skin = cv2.inRange(cv2.cvtColor(picture, cv2.COLOR_RGB2YCrCb), (60, 135, 85), (255, 180, 135))
    found = []
    for contour in _contours(skin):
        left, top, width, height = cv2.boundingRect(contour)
        if not 0.8 * width <= height <= 2.0 * width:
            continue
        rows = slice(top + height * 3 // 10, top + height * 6 // 10)  # below the hair
        middle = picture[rows, left + width // 10 : left + width * 9 // 10]
        gray = cv2.cvtColor(middle, cv2.COLOR_RGB2GRAY)
        eyes = _contours((gray < 0.5 * np.median(gray)).astype(np.uint8), smallest=2)
        centers = [cv2.minEnclosingCircle(eye)[0] for eye in eyes[:2]]
        if len(centers) == 2:
            (x1, y1), (x2, y2) = centers
            if 0.2 * width < abs(x1 - x2) < 0.7 * width and abs(y1 - y2) < 0.15 * height:
                found.append(_region(left, top, left + width, top + height))
    return found


def _region(left: float, top: float, right: float, bottom: float) -> Region:
    return float(left + right) / 2, float(top + bottom) / 2, float(right - left), float(bottom - top)


def _contours(mask: Any, smallest: int = _SMALLEST) -> list[Any]:  # noqa: ANN401 - OpenCV's arrays
    """Return the outlines of a mask's regions, the largest first."""
    import cv2

    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    large = [outline for outline in outlines if cv2.contourArea(outline) >= smallest]
    return sorted(large, key=cv2.contourArea, reverse=True)[:_MOST_SEEN]


class Detector(Extractor):
    """Look through a camera while there are subscribers, and raise an event with what is seen."""

    KEY: ClassVar[str]
    """The event, whose value is an empty list when nothing is seen any more."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._memory = access.service(ALMemory)
        self._memory.extractors[self.KEY] = self
        self._camera = 0
        self.seen: Sequence[Detection] = []
        """The detections in the newest picture: the region in angles, and further data."""
        self._failing = False

    def setActiveCamera(self, camera: object) -> bool:
        """Use the top camera, 0, or the bottom one, 1."""
        last = min(len(_CAMERAS), len(self._robot.cameras)) - 1
        self._camera = int(number_within(camera, "camera", 0, last))
        return True

    def getActiveCamera(self) -> int:
        """Return the number of the camera."""
        return self._camera

    def _require(self) -> None:
        if not self._robot.cameras:
            raise HardwareFailure("this robot has no camera")
        try:
            self._load()
        except ModuleNotFoundError as error:
            raise HardwareFailure(missing_package(error, "vision")) from None
        self._memory.insertData(self.KEY, [])

    def _look(self) -> None:
        """Look at the newest picture, and raise the event; due every LOOKING while there are subscribers."""
        before = self.seen
        try:
            time, self.seen = self._see(self._robot.cameras[self._camera])
        except RobotError as error:
            if not self._failing:
                _logger.warning("%s sees nothing: %s", self.KEY, error)
            self._failing = True
            return
        self._failing = False
        if self.seen:
            seconds, fraction = divmod(time, 1.0)
            stamp = [int(seconds), int(fraction * 1e6)]
            self._memory.raiseEvent(self.KEY, self._value(stamp, self._poses()))
        elif before:
            self._memory.raiseEvent(self.KEY, [])

    def _load(self) -> None:
        """Load what it sees with. Raises ModuleNotFoundError for a missing package."""
        raise NotImplementedError

    def _see(self, camera: CameraFacts) -> tuple[float, Sequence[Detection]]:
        """Return the robot time of the newest picture in s, and the detections, regions in angles."""
        raise NotImplementedError

    def _value(self, stamp: list[int], poses: list[object]) -> list[object]:
        """Return the event's value: by default that of a single detection."""
        return [stamp, list(self.seen[0][0]), *poses, self._camera]

    def _poses(self) -> list[object]:
        """Return the place of the camera in the torso's and in the robot's frame."""
        name = _CAMERAS[self._camera]
        return [numbers_of(self._access.place(name, frame, measured=True)) for frame in (0, 2)]


def _in_angles(region: Region, facts: CameraFacts) -> Region:
    """Return a region in angles in rad: center, to the left and down from the picture's, and size."""
    x, y, width, height = region
    focal = _SIZE[0] / 2 / math.tan(facts.horizontal_fov / 2)
    return (
        math.atan2(_SIZE[0] / 2 - x, focal),
        math.atan2(y - _SIZE[1] / 2, focal),
        2.0 * math.atan2(width / 2, focal),
        2.0 * math.atan2(height / 2, focal),
    )


class ALRedBallDetection(Detector):
    """Detect a red ball by what the robot serves as `Sight`, or else by eyes as those of `nao eyes`."""

    KEY = "redBallDetected"

    _radius: float
    """In m, of red balls: `Sight` knows where they are, but not how large."""
    _sight: Callable[[], nao.SightReading]

    def _load(self) -> None:
        servants = self._access.servants
        servant: Any = servants.get("Sight")
        if servant is None:
            from naoserver.eyes.local import local_sight

            servant = local_sight({camera.name: servants[camera.name] for camera in self._robot.body.cameras})
        self._sight = lambda: servant.getSight(None)
        self._radius = read_looks().balls["red"]

    def _see(self, camera: CameraFacts) -> tuple[float, Sequence[Detection]]:
        reading = self._sight()
        balls = [
            thing
            for thing in reading.things
            if (thing.kind, thing.name, thing.camera) == ("ball", "red", camera.name)
        ]
        if not balls:
            return reading.time, []
        ball = min(balls, key=lambda ball: ball.distance)  # which looks largest
        size = 2.0 * math.atan(self._radius / ball.distance)
        return ball.time, [((ball.left, ball.down, size, size), None)]


class PictureDetector(Detector):
    """Search the pictures of a camera."""

    def _load(self) -> None:
        import cv2  # noqa: F401 - is it installed?

    def _see(self, camera: CameraFacts) -> tuple[float, Sequence[Detection]]:
        frame = self._robot.capture(camera.name, *_SIZE)
        return frame.time, [(_in_angles(region, camera), what) for region, what in self._find(frame.pixels)]

    def _find(self, picture: Pixels) -> Sequence[Detection]:
        """Return the detected regions, each with further data."""
        raise NotImplementedError


class ALLandMarkDetection(PictureDetector):
    """Detect landmarks and their numbers."""

    KEY = "LandmarkDetected"

    def _find(self, picture: Pixels) -> Sequence[Detection]:
        return [(region, number) for number, region in find_landmarks(picture)]

    def _value(self, stamp: list[int], poses: list[object]) -> list[object]:
        marks = [[[0, *region, 0.0], [number]] for region, number in self.seen]
        return [stamp, marks, *poses, _CAMERAS[self._camera]]


class ALFaceDetection(PictureDetector):
    """Detect faces. All faces of a world look alike: each is recognized as that which was learned last."""

    KEY = "FaceDetected"

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._learned: dict[str, None] = {}  # names, the newest last
        self._recognizes = True
        self._greeted = ""  # who was recognized before, as long as some face is seen
        self._met = -math.inf  # when a face was seen last

    setTrackingEnabled, isTrackingEnabled = kept("whether it follows faces", True, enable=switch)

    def _find(self, picture: Pixels) -> Sequence[Detection]:
        return [(region, number) for number, region in enumerate(find_faces(picture), 1)]

    def _value(self, stamp: list[int], poses: list[object]) -> list[object]:
        name = ["", *self._learned][-1] if self._recognizes else ""
        now = self._robot.clock.now()
        news = [2, [name]] if name and (name != self._greeted or now - self._met > _FORGETTING) else []
        self._greeted, self._met = name, now
        known = [float(bool(name)), name]
        faces: list[object] = [[[0, *region], [number, *known]] for region, number in self.seen]
        return [stamp, [*faces, news], *poses, self._camera]

    def learnFace(self, call: Call, name: object) -> bool:  # noqa: ARG002 - a picture may take long
        """Learn the face in the newest picture under a name; returns whether there is one."""
        new = text(name, "name")
        self._require()
        self._look()
        if self.seen:
            self.forgetPerson(new)
            self._learned[new] = None
            if len(self._learned) > _MOST_LEARNED:
                self.forgetPerson(next(iter(self._learned)))
        return bool(self.seen)

    reLearnFace = learnFace

    def forgetPerson(self, name: object) -> bool:
        """Forget the face of a name; returns whether it was learned."""
        return self._learned.pop(text(name, "name"), False) is None

    def clearDatabase(self) -> bool:
        """Forget every face; returns True."""
        self._learned.clear()
        return True

    def getLearnedFacesList(self) -> list[str]:
        """Return the names of the learned faces."""
        return list(self._learned)

    def setRecognitionEnabled(self, enable: object) -> None:
        """Recognize learned faces, or only detect them."""
        self._recognizes = bool(enable)

    def isRecognitionEnabled(self) -> bool:
        """Return whether learned faces are recognized."""
        return self._recognizes

    enableRecognition, enableTracking = setRecognitionEnabled, setTrackingEnabled  # their former names


class ALColorBlobDetection(PictureDetector):
    """Detect the largest region of a color."""

    KEY = "ALTracker/ColorBlobDetected"

    _color, _tolerance = (255, 0, 0), 60

    def setColor(self, red: object, green: object, blue: object, tolerance: object) -> None:
        """Look for a color of three parts from 0 to 255, each of which may differ by the tolerance."""
        parts = zip(("red", "green", "blue"), (red, green, blue), strict=True)
        r, g, b = (round(number_within(value, what, 0, 255)) for what, value in parts)
        self._color, self._tolerance = (r, g, b), round(number_within(tolerance, "tolerance", 0, 255))

    def getColor(self) -> list[int]:
        """Return the color and the tolerance."""
        return [*self._color, self._tolerance]

    setObjectProperties = constant(
        "Do nothing but check the values: the largest region is detected, whatever its shape.",
        minSize=number,
        span=number,
        shape=text,
    )

    def _find(self, picture: Pixels) -> Sequence[Detection]:
        blob = find_blob(picture, self._color, self._tolerance)
        return [] if blob is None else [(blob, None)]
