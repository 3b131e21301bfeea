"""ALTracker: follow what a detector sees with the head, or by walking to it."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Mapping
from typing import Final

from naoserver.capabilities import WalkVelocity
from naoserver.errors import InvalidCommand, RobotError
from naoserver_qi.access import Access, Walking
from naoserver_qi.arguments import chosen, listed, number, number_within
from naoserver_qi.motion import ALMotion
from naoserver_qi.vision import Detector

_logger = logging.getLogger(__name__)

_NAME: Final = "ALTracker"
_MODES: Final = ("Head", "WholeBody", "Move")
_SIZES: Final = {"RedBall": 0.06, "Face": 0.1, "LandMark": 0.09}
"""Width in m of a target for which none is given."""
_SHARE: Final = 0.3
"""Fraction of full speed at which the head follows."""
_GAIN: Final = 0.5
"""Share of the error in angle that a look corrects: pictures are some tenths of a second old."""
_SPEED: Final = 0.5
"""Velocity of the walk in 1/s relative to the rest of the way."""
_NEAR: Final = 0.3
"""Distance in m at which the walk stops where none is given."""
_LOST: Final = 5
"""Looks without the target after which it is lost."""
_HEAD: Final = ("HeadYaw", "HeadPitch")


class ALTracker:
    """Follow a ball, a face or a landmark."""

    def __init__(
        self, access: Access, motion: ALMotion, walking: Walking, detectors: Mapping[str, Detector]
    ) -> None:
        self._access = access
        self._motion = motion
        self._walking = walking
        self._detectors = detectors
        self._lock = threading.Lock()
        self._sizes: dict[str, float] = {}  # of the registered targets, in m
        self._target = ""
        self._mode = _MODES[0]
        self._distance = _NEAR
        self._missed = 0
        self._at: tuple[float, float, float] | None = None  # distance, and angles to the left and down

    def registerTarget(self, target: object, params: object) -> None:
        """Say how wide a target is in m, or a list whose first entry is that; a landmark's numbers follow."""
        name = chosen(target, "target", self._detectors)
        first = listed(params, "params")[0] if isinstance(params, (list, tuple)) and params else params
        size = number(first, "size") if isinstance(first, (int, float)) else _SIZES[name]
        self._sizes[name] = number_within(size, "size", 0.005, 5.0)

    def track(self, target: object) -> None:
        """Follow a target from now on."""
        name = chosen(target, "target", self._detectors)
        self.stopTracker()
        self._detectors[name].subscribe(_NAME)
        with self._lock:
            self._sizes.setdefault(name, _SIZES[name])
            self._target, self._missed, self._at = name, _LOST, None

    def stopTracker(self) -> None:
        """Follow nothing any more; a walk to the target ends."""
        with self._lock:
            target, self._target, self._at = self._target, "", None
        if target:
            self._detectors[target].unsubscribe(_NAME)
            if self._mode == "Move":
                self._walking.stop()

    def unregisterTarget(self, target: object) -> None:
        """Forget a target, which is not followed any more."""
        name = chosen(target, "target", self._detectors)
        if name == self._target:
            self.stopTracker()
        self._sizes.pop(name, None)

    def unregisterAllTargets(self) -> None:
        """Forget all targets."""
        self.stopTracker()
        self._sizes.clear()

    def setMode(self, mode: object) -> None:
        """Follow with the `Head`, or `Move` to the target as well; `WholeBody` is the head alone."""
        self._mode = chosen(mode, "mode", _MODES)

    def getMode(self) -> str:
        """Return how it follows."""
        return self._mode

    def getAvailableModes(self) -> list[str]:
        """Return the modes."""
        return list(_MODES)

    def setRelativePosition(self, target: object) -> None:
        """Stop at a distance, the negative first number of a list, in m before the target."""
        first, *_ = listed(target, "position") or [0.0]
        self._distance = abs(number_within(first, "distance", -3.0, 3.0))

    def isActive(self) -> bool:
        """Return whether it follows something."""
        return bool(self._target)

    def getActiveTarget(self) -> str:
        """Return what it follows; nothing at all as an empty text."""
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

    def lookAt(self, position: object, *rest: object) -> None:
        """Turn the head to a point of x, y and z in m: in a frame, at a fraction of full speed, or both."""
        x, y, z = (number(part, "position") for part in listed(position, "position", 3))
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

    def _follow(self) -> None:
        """Correct the head, and the walk, by the newest picture; due every LOOKING."""
        with self._lock:
            target = self._target
        if not target:
            return
        seen = self._detectors[target].seen
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
        """Send the head to angles, within what it can."""
        facts = [self._access.body.facts(joint) for joint in _HEAD]
        aims = [min(max(at, joint.lower), joint.upper) for at, joint in zip((yaw, pitch), facts, strict=True)]
        self._motion._send(_HEAD, aims, share)
