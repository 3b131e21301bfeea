"""ALTracker, which follows what a detector sees with the head or by walking, and the trackers of NAOqi 1."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from contextlib import suppress
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import WalkVelocity
from naoserver.errors import InvalidCommand, RobotError
from visualhfsm_naoqi.programs._access import Access, Service
from visualhfsm_naoqi.programs._arguments import (
    chosen,
    constant,
    keepable,
    kept,
    listed,
    number,
    number_within,
    one_of,
    refused,
    switch,
    text,
    vector,
)
from visualhfsm_naoqi.programs._clients import Activity, Call, Client, begins, running
from visualhfsm_naoqi.programs._motion import ALMotion
from visualhfsm_naoqi.programs._vision import (
    ALFaceDetection,
    ALLandMarkDetection,
    ALRedBallDetection,
    Detector,
)

_logger = logging.getLogger(__name__)

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
_EFFECTOR: Final = one_of("effector", ("None", "Arms", "LArm", "RArm"))


class ALTracker(Service):
    """Follow a ball, a face or a landmark."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._motion = access.service(ALMotion)
        self._walking = access.walking
        self._head = access.joints.chains["Head"]
        self._sizes: dict[str, float] = {}  # of the registered targets, in m
        self._target = ""
        self._mode = _MODES[0]
        self._distance = _NEAR
        self._missed = 0
        self._at: tuple[float, float, float] | None = None  # distance, and angles to the left and down
        self._tracking: Call | None = None  # while it follows, and may be stopped as any that moves the head
        self._detections = 0

    getAvailableModes = constant("Return the modes.", list(_MODES))
    setEffector, getEffector = kept("the arm that points to the target", "None", pEffector=_EFFECTOR)
    setTimeOut, getTimeOut = kept("the time in ms after which it searches", 2000, pTimeMs=number)
    getSupportedTargets = getTargetNames = constant("Return the targets.", list(_TARGETS))
    trackEvent = refused("nobody raises the events of people whom it could follow")
    toggleSearch, isSearchEnabled = kept("whether it searches for a lost target", True, pSearch=switch)

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
        calls, activities = self._access.calls, {Activity.JOINTS}
        if self._mode == "Move":
            activities.add(Activity.WALK)
        client = calls.current.client
        tracking = Call(self._robot.clock, client, frozenset(activities), (list(self._head),))
        calls.add(tracking, math.inf)
        with self._lock:
            self._tracking = tracking
            self._sizes.setdefault(name, _TARGETS[name][1])
            self._target = name
            self._missed = _LOST
            self._at = None

    def stopTracker(self) -> None:
        """Stop following; a walk to the target ends."""
        with self._lock:
            target = self._target
            self._target = ""
            self._at = None
            tracking, self._tracking = self._tracking, None
        if tracking is not None:
            self._access.calls.remove(tracking)
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
        if target := self._target:
            self.track(target)  # what stops it depends on the mode

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
        point, share = self._point(position, *(rest if len(rest) == 3 else (0, *rest)))
        ahead, left, up = point - self._access.place("Head", 0, measured=True)[:3, 3]
        self._aim(math.atan2(left, ahead), -math.atan2(up, math.hypot(ahead, left)), share)

    @begins(Activity.JOINTS)
    def pointAt(self, call: Call, effector: object, position: object, *rest: object) -> None:
        """Point `LArm`, `RArm`, or with `Arms` one of them, at a point as in lookAt; returns at the end."""
        arm = chosen(effector, "effector", ("Arms", "LArm", "RArm"))
        point, share = self._point(position, *(rest if len(rest) == 2 else (0, *rest)))
        side = ("L" if point[1] >= 0.0 else "R") if arm == "Arms" else arm[0]
        joints = [f"{side}{joint}" for joint in ("ShoulderPitch", "ShoulderRoll", "ElbowRoll")]
        ahead, left, up = point - self._access.place(joints[0], 0, measured=True)[:3, 3]
        straight = -math.atan2(up, ahead), math.atan2(left, math.hypot(ahead, up)), 0.0
        self._motion.angleInterpolationWithSpeed(call, joints, self._within_range(joints, straight), share)

    def _point(
        self, position: object, frame: object, fraction: object = 0.5, *_: object
    ) -> tuple[NDArray[np.float64], float]:
        """Return a point of x, y and z in m in the torso's frame, and the fraction of full speed."""
        point, share = vector(position, "position", 3), number_within(fraction, "the fraction", 0.01, 1.0)
        torso = self._access.place("Torso", frame, measured=True)
        at = torso[:3, :3].T @ (point - torso[:3, 3])
        if math.hypot(*at) < 0.01:
            raise InvalidCommand("position", "the point is within the robot")
        return at, share

    def _forget(self, client: Client) -> None:
        """Stop following for a lost client."""
        super()._forget(client)
        tracking = self._tracking
        if tracking is not None and tracking.client is client:
            self.stopTracker()

    def _detector(self, target: str) -> Detector:
        return self._access.service(_TARGETS[target][0])

    def _follow(self) -> None:
        """Correct the head, and the walk, by the newest picture; due every LOOKING."""
        with self._lock:
            target, call = self._target, self._tracking
        if call is not None and call.stopped.is_set():
            self.stopTracker()
        elif call is not None and target:
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
        self._detections += 1
        (left, down, width, _), _ = seen[0]
        self._at = self._sizes[target] / 2.0 / math.tan(max(width, 0.01) / 2.0), left, down
        angles = self._access.angles(measured=True)
        try:
            yaw, pitch = (angles[joint] for joint in self._head)
            self._aim(yaw + _GAIN * left, pitch + _GAIN * down, _SHARE)
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
        self._walking.begin(WalkVelocity(forward, 0.0, min(max(turn, -limits.turn), limits.turn)), limits)

    def _aim(self, yaw: float, pitch: float, share: float) -> None:
        """Send the head to angles, within its range."""
        self._motion._send(self._head, self._within_range(self._head, (yaw, pitch)), share, together=False)

    def _within_range(self, joints: Sequence[str], angles: Sequence[float]) -> list[float]:
        facts = map(self._access.body.facts, joints)
        return [min(max(at, joint.lower), joint.upper) for at, joint in zip(angles, facts, strict=True)]


class _HeadTracker(Service):
    """Follow one kind of target with the head."""

    TARGET: ClassVar[str]

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._tracker = access.service(ALTracker)

    def _start(self) -> None:
        """Start following."""
        self._tracker.setMode("Head")
        self._tracker.track(self.TARGET)

    def _stop(self) -> None:
        """Stop following."""
        if self._active():
            self._tracker.stopTracker()

    def _active(self) -> bool:
        """Return whether it follows."""
        return self._tracker.getActiveTarget() == self.TARGET


class _FormerTracker(_HeadTracker):
    """A tracker of NAOqi 1."""

    _taken = 0
    """Detections before the newest answer."""

    startTracker, stopTracker, isActive = _HeadTracker._start, _HeadTracker._stop, _HeadTracker._active
    setWholeBodyOn = constant("Do nothing: the head alone follows.", pWholeBodyOn=switch)

    def getPosition(self) -> list[float]:
        """Return x, y and z of the target in m, in the torso's frame; an empty list before it was seen."""
        self._taken = self._tracker._detections
        return self._tracker.getTargetPosition(0) if self._active() else []

    def isNewData(self) -> bool:
        """Return whether the target has been seen since the last getPosition."""
        return self._active() and self._tracker._detections > self._taken


class ALRedBallTracker(_FormerTracker):
    """Follow a red ball with the head, as NAOqi 1 does."""

    TARGET = "RedBall"


class ALFaceTracker(_FormerTracker):
    """Follow a face with the head, as NAOqi 1 does."""

    TARGET = "Face"


class ALLandMarkTracker(_FormerTracker):
    """Follow a landmark with the head, as NAOqi 1 does."""

    TARGET = "LandMark"


class ALBasicAwareness(_HeadTracker):
    """Follow a face with the head while it runs; nothing else attracts this robot."""

    TARGET = "Face"

    startAwareness = resumeAwareness = _HeadTracker._start
    stopAwareness = pauseAwareness = _HeadTracker._stop
    isEnabled = isAwarenessRunning = _HeadTracker._active
    setStimulusDetectionEnabled, isStimulusDetectionEnabled = kept(
        "whether a stimulus such as `Sound` attracts it", True, stimulusName=text, enable=switch
    )
    setEngagementMode, getEngagementMode = kept("the mode of engagement", "Unengaged", modeName=text)
    setTrackingMode, getTrackingMode = kept("the mode of tracking", "Head", modeName=text)
    setParameter, getParameter = kept("a parameter", 0.0, paramName=text, newVal=keepable)

    def setEnabled(self, enabled: object) -> None:
        """Start following, or stop it."""
        (self._start if enabled else self._stop)()
