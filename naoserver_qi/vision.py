"""NAOqi's detectors of red balls, landmarks, faces and blobs of a color, and ALTracker, which follows them.

Landmarks are ArUco marks of 4 by 4 bits, whose numbers are reported. World files place them, and faces, as
signs. Detection uses the robot's own pictures; the tracker follows with the head, or by walking.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from hfsm_command import missing_package
from naoserver.capabilities import WalkVelocity
from naoserver.errors import HardwareFailure, InvalidCommand, RobotError
from naoserver.kinematics import numbers_of
from naoserver.robot import CameraFacts
from naoserver_qi.access import Access, Service
from naoserver_qi.arguments import chosen, constant, listed, number, number_within, switch, vector
from naoserver_qi.clients import Activity, Client, begins, running
from naoserver_qi.memory import ALMemory
from naoserver_qi.motion import ALMotion
from naoserver_qi.sensors import Extractor

_logger = logging.getLogger(__name__)

LOOKING: Final = 0.1
"""Robot seconds between two detections."""
_SIZE: Final = (320, 240)
_CAMERAS: Final = ("CameraTop", "CameraBottom")
_MOST_SEEN: Final = 10
_SMALLEST: Final = 20
"""Pixels of the smallest region that is detected."""
_ROUND: Final = 0.7
"""Minimum share of its enclosing circle that a ball fills."""

Pixels = NDArray[np.uint8]
Region = tuple[float, float, float, float]
"""Center (to the right and down), width and height, in pixels."""


def find_red_ball(picture: Pixels) -> Region | None:
    """Return the largest round red region of an RGB picture."""
    import cv2

    hsv = cv2.cvtColor(picture, cv2.COLOR_RGB2HSV)
    red = cv2.inRange(hsv, (0, 140, 60), (8, 255, 255)) | cv2.inRange(hsv, (172, 140, 60), (180, 255, 255))
    for contour in _contours(red):
        (x, y), radius = cv2.minEnclosingCircle(contour)
        if cv2.contourArea(contour) > _ROUND * math.pi * radius * radius:
            return x, y, 2.0 * radius, 2.0 * radius
    return None


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
    found = zip([] if numbers is None else numbers.ravel(), (corner[0] for corner in corners), strict=True)
    return sorted((int(mark), _region(*edges.min(axis=0), *edges.max(axis=0))) for mark, edges in found)


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
    """Search pictures of a camera while there are subscribers, and raise an event with the results."""

    KEY: ClassVar[str]
    """The event, whose value is an empty list when nothing is seen any more."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._memory = access.service(ALMemory)
        self._camera = 0
        self.seen: list[tuple[Region, Any]] = []
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
            import cv2  # noqa: F401 - is it installed?
        except ModuleNotFoundError as error:
            raise HardwareFailure(missing_package(error, "vision")) from None
        self._memory.insertData(self.KEY, [])

    def _look(self) -> None:
        """Take a picture, and raise the event; due every LOOKING while there are subscribers."""
        facts = self._robot.cameras[self._camera]
        try:
            frame = self._robot.capture(facts.name, *_SIZE)
        except RobotError as error:
            if not self._failing:
                _logger.warning("%s sees nothing: %s", self.KEY, error)
            self._failing = True
            return
        self._failing = False
        before = self.seen
        self.seen = [(_in_angles(region, facts), what) for region, what in self._find(frame.pixels)]
        if self.seen:
            seconds, fraction = divmod(frame.time, 1.0)
            stamp = [int(seconds), int(fraction * 1e6)]
            self._memory.raiseEvent(self.KEY, self._value(stamp, self._poses()))
        elif before:
            self._memory.raiseEvent(self.KEY, [])

    def _find(self, picture: Pixels) -> Sequence[tuple[Region, Any]]:
        """Return the detected regions, each with further data."""
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
    """Detect a red ball."""

    KEY = "redBallDetected"

    def _find(self, picture: Pixels) -> Sequence[tuple[Region, Any]]:
        ball = find_red_ball(picture)
        return [] if ball is None else [(ball, None)]


class ALLandMarkDetection(Detector):
    """Detect landmarks and their numbers."""

    KEY = "LandmarkDetected"

    def _find(self, picture: Pixels) -> Sequence[tuple[Region, Any]]:
        return [(region, number) for number, region in find_landmarks(picture)]

    def _value(self, stamp: list[int], poses: list[object]) -> list[object]:
        marks = [[[0, *region, 0.0], [number]] for region, number in self.seen]
        return [stamp, marks, *poses, _CAMERAS[self._camera]]


class ALFaceDetection(Detector):
    """Detect faces, without recognizing people."""

    KEY = "FaceDetected"

    def _find(self, picture: Pixels) -> Sequence[tuple[Region, Any]]:
        return [(region, number) for number, region in enumerate(find_faces(picture), 1)]

    def _value(self, stamp: list[int], poses: list[object]) -> list[object]:
        faces: list[object] = [[[0, *region], [number, 0.0, ""]] for region, number in self.seen]
        return [stamp, [*faces, []], *poses, self._camera]

    setRecognitionEnabled = constant("Do nothing: it does not recognize anybody.", enable=switch)
    setTrackingEnabled = constant("Do nothing: ALTracker follows a face.", enable=switch)


class ALColorBlobDetection(Detector):
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

    def _find(self, picture: Pixels) -> Sequence[tuple[Region, Any]]:
        blob = find_blob(picture, self._color, self._tolerance)
        return [] if blob is None else [(blob, None)]


_NAME: Final = "ALTracker"
_MODES: Final = ("Head", "WholeBody", "Move")
_TARGETS: Final[dict[str, tuple[type[Detector], float]]] = {
    "RedBall": (ALRedBallDetection, 0.06),
    "Face": (ALFaceDetection, 0.1),
    "LandMark": (ALLandMarkDetection, 0.09),
}
"""The detector of each target, and its default width in m."""
_SHARE: Final = 0.3
"""Fraction of full speed at which the head follows."""
_GAIN: Final = 0.5
"""Share of the angular error corrected at each detection: pictures are some tenths of a second old."""
_SPEED: Final = 0.5
"""Ratio of the walk's velocity to the rest of the way, in 1/s."""
_NEAR: Final = 0.3
"""Default distance in m at which the walk stops."""
_LOST: Final = 5
"""Detections without the target after which it is lost."""
_HEAD: Final = ("HeadYaw", "HeadPitch")


class ALTracker(Service):
    """Follow a ball, a face or a landmark."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._motion = access.service(ALMotion)
        self._walking = access.walking
        self._sizes: dict[str, float] = {}  # of the registered targets, in m
        self._target = ""
        self._mode = _MODES[0]
        self._distance = _NEAR
        self._missed = 0
        self._at: tuple[float, float, float] | None = None  # distance, and angles to the left and down
        self._tracking = access.calls.current  # the call for which it follows

    getAvailableModes = constant("Return the modes.", list(_MODES))

    def registerTarget(self, target: object, params: object) -> None:
        """Register a target by its width in m, or by a list of the width and a landmark's numbers."""
        name = chosen(target, "target", _TARGETS)
        first = listed(params, "params")[0] if isinstance(params, (list, tuple)) and params else params
        size = number(first, "size") if isinstance(first, (int, float)) else _TARGETS[name][1]
        self._sizes[name] = number_within(size, "size", 0.005, 5.0)

    def track(self, target: object) -> None:
        """Start following a target."""
        name = chosen(target, "target", _TARGETS)
        self.stopTracker()
        self._detector(name).subscribe(_NAME)
        with self._lock:
            self._tracking = self._access.calls.current
            self._sizes.setdefault(name, _TARGETS[name][1])
            self._target, self._missed, self._at = name, _LOST, None

    def stopTracker(self) -> None:
        """Stop following; a walk to the target ends."""
        with self._lock:
            target, self._target, self._at = self._target, "", None
        if target:
            with suppress(InvalidCommand):  # anybody may have unsubscribed it
                self._detector(target).unsubscribe(_NAME)
            if self._mode == "Move":
                self._walking.stop()

    def unregisterTarget(self, target: object) -> None:
        """Remove a target, which is no longer followed."""
        name = chosen(target, "target", _TARGETS)
        if name == self._target:
            self.stopTracker()
        self._sizes.pop(name, None)

    def unregisterAllTargets(self) -> None:
        """Remove all targets."""
        self.stopTracker()
        self._sizes.clear()

    def setMode(self, mode: object) -> None:
        """Follow with the `Head`, or `Move` to the target as well; `WholeBody` is the head alone."""
        self._mode = chosen(mode, "mode", _MODES)

    def getMode(self) -> str:
        """Return how it follows."""
        return self._mode

    def setRelativePosition(self, target: object) -> None:
        """Stop at a distance, the negative first number of a list, in m in front of the target."""
        first, *_ = listed(target, "position") or [0.0]
        self._distance = abs(number_within(first, "distance", -3.0, 3.0))

    def isActive(self) -> bool:
        """Return whether it follows something."""
        return bool(self._target)

    def getActiveTarget(self) -> str:
        """Return what it follows, or an empty text."""
        return self._target

    def getRegisteredTargets(self) -> list[str]:
        """Return the registered targets."""
        return list(self._sizes)

    def isTargetLost(self) -> bool:
        """Return whether the target has not been seen for half a second."""
        return self._missed >= _LOST

    def isNewTargetDetected(self) -> bool:
        """Return whether the newest picture shows the target."""
        return bool(self._target) and self._missed == 0

    def getTargetPosition(self, frame: object = 0) -> list[float]:
        """Return x, y and z of the target in m; an empty list before it was seen."""
        if (at := self._at) is None:
            return []
        distance, left, down = at
        ahead = distance * math.cos(down)
        place = self._access.place("CameraTop", frame, measured=True)
        point = (ahead * math.cos(left), ahead * math.sin(left), -distance * math.sin(down), 1.0)
        return [float(part) for part in (place @ point)[:3]]

    @begins(Activity.JOINTS)
    def lookAt(self, position: object, *rest: object) -> None:
        """Turn the head to a point of x, y and z in m: in a frame, at a fraction of full speed, or both."""
        x, y, z = vector(position, "position", 3)
        frame, *rest_ = rest if len(rest) == 3 else (0, *rest)
        share = number_within(rest_[0] if rest_ else 0.5, "the fraction", 0.01, 1.0)
        torso = self._access.place("Torso", frame, measured=True)
        turn, at = torso[:3, :3].T, (x, y, z) - torso[:3, 3]
        ahead, left, up = turn @ at
        if math.hypot(ahead, left, up) < 0.01:
            raise InvalidCommand("position", "the point is within the robot")
        neck = self._access.place("HeadPitch", 0, measured=True)[:3, 3]
        ahead, left, up = (part - own for part, own in zip((ahead, left, up), neck, strict=True))
        self._aim(math.atan2(left, ahead), -math.atan2(up, math.hypot(ahead, left)), share)

    def _forget(self, client: Client) -> None:
        """Stop following for a lost client."""
        super()._forget(client)
        if self._tracking.client is client:
            self.stopTracker()

    def _detector(self, target: str) -> Detector:
        return self._access.service(_TARGETS[target][0])

    def _follow(self) -> None:
        """Correct the head, and the walk, by the newest picture; due every LOOKING."""
        with self._lock:
            target, call = self._target, self._tracking
        if target:
            with running(call):
                self._aim_at(target)

    def _aim_at(self, target: str) -> None:
        seen = self._detector(target).seen
        if not seen:
            self._missed = min(self._missed + 1, _LOST)
            if self._missed == _LOST and self._mode == "Move" and self._walking.moving:
                self._walking.stop()
            return
        self._missed = 0
        (left, down, width, _), _ = seen[0]
        self._at = self._sizes[target] / 2.0 / math.tan(max(width, 0.01) / 2.0), left, down
        angles = self._access.angles(measured=True)
        try:
            self._aim(angles["HeadYaw"] + _GAIN * left, angles["HeadPitch"] + _GAIN * down, _SHARE)
            if self._mode == "Move":
                self._approach()
        except RobotError as error:
            _logger.warning("ALTracker stops: %s", error)
            self.stopTracker()

    def _approach(self) -> None:
        """Walk towards the target, or stand before it."""
        x, y, _ = self.getTargetPosition(2)
        rest = math.hypot(x, y) - self._distance
        turn = math.atan2(y, x)
        if rest < 0.05 and abs(turn) < 0.2:
            self._walking.stop()
            return
        limits = self._motion._walk_limits([])
        forward = min(max(_SPEED * rest, -limits.forward), limits.forward) if abs(turn) < 0.6 else 0.0
        self._walking.go(WalkVelocity(forward, 0.0, min(max(turn, -limits.turn), limits.turn)), limits)

    def _aim(self, yaw: float, pitch: float, share: float) -> None:
        """Send the head to angles, within its range."""
        facts = [self._access.body.facts(joint) for joint in _HEAD]
        aims = [min(max(at, joint.lower), joint.upper) for at, joint in zip((yaw, pitch), facts, strict=True)]
        self._motion._send(_HEAD, aims, share)
