"""Walk for clients of NAOqi, who command a velocity once and expect the robot to keep it."""

from __future__ import annotations

import logging
import math
import threading
from dataclasses import asdict, astuple
from typing import Final

from naoserver.capabilities import Odometry, WalkVelocity
from naoserver.errors import HardwareFailure, RobotError
from naoserver.walk_guard import WalkGuard
from naoserver_qi.access import CLIENT, Access
from naoserver_qi.calls import Call

__all__ = ["RENEWAL", "Walking"]

_logger = logging.getLogger(__name__)

RENEWAL: Final = 0.15
"""Wall seconds after which a command is renewed: well within the guard's timeout."""
_PERIOD: Final = 0.05
"""Robot seconds between two corrections on the way to a goal."""
_STILL: Final = WalkVelocity()
_SHARE: Final = 0.7
"""Of the highest velocities, on the way to a goal."""
_GAIN: Final = 1.5
"""Velocity in 1/s of what is left of the way."""
_CLOSE: Final = 0.02
"""Distance in m, and in rad / 2, within which a goal counts as reached."""
_PATIENCE: Final = 10.0
"""Robot seconds that a way may take beside three times what it takes at full speed."""


class Walking:
    """Walk through the guard, and renew what was commanded until something ends it.

    The guard stops what is not renewed. libqi does not report when a client is gone, so a walk goes on as it
    does on the real robot, until stopMove, another client, a fall, the emergency stop or the end of the
    service.
    """

    def __init__(self, access: Access) -> None:
        self._walker = access.robot.walker
        self._access = access
        self._lock = threading.Lock()
        self._wanted = _STILL
        self._closed = False

    @property
    def guard(self) -> WalkGuard:
        """The walk behind its safety layer. Raises HardwareFailure when there is none."""
        if self._access.walk is None:
            raise HardwareFailure("this robot does not walk")
        return self._access.walk

    @property
    def active(self) -> bool:
        """Whether a velocity is commanded."""
        return self._access.walk is not None and self._access.walk.commanded() != _STILL

    @property
    def moving(self) -> bool:
        """Whether it moves the legs: from a command until it stands on both feet again."""
        return self.active or (self._walker is not None and self._walker.walking)

    def go(self, velocity: WalkVelocity) -> None:
        """Walk at a velocity until further notice. Raises as `WalkGuard.drive` does."""
        with self._lock:
            if self._closed:
                return
            self._drive(velocity)

    def stop(self) -> None:
        """End the walk on both feet; nobody is refused to."""
        with self._lock:
            self._wanted = _STILL
            if self._access.walk is not None:
                self._access.walk.stop()

    def go_to(self, call: Call, x: float, y: float, heading: float, start: Odometry | None = None) -> bool:
        """Walk to a place in m and rad as the robot stands, or stood at `start`; return whether it came."""
        guard = self.guard
        if start is None:
            start = guard.read()
        cos, sin = math.cos(start.heading), math.sin(start.heading)
        goal_x, goal_y = start.x + cos * x - sin * y, start.y + sin * x + cos * y
        highest = WalkVelocity(*(_SHARE * limit for limit in astuple(guard.limits)))
        patience = _PATIENCE + 3.0 * (
            math.hypot(x / highest.forward, y / highest.left) + abs(heading) / highest.turn
        )
        begin = guard.read().time
        began = False
        try:
            while not call.stopped.is_set():
                now = guard.read()
                left = _to_the_robot(now, goal_x - now.x, goal_y - now.y, start.heading + heading)
                if math.hypot(left.forward, left.left) < _CLOSE and abs(left.turn) < 2 * _CLOSE:
                    return True
                if now.time - begin > patience or (began and not self.active):
                    return False
                self.go(_limited(left, highest))
                began = True
                call.wait(_PERIOD)
            return False
        finally:
            self.stop()
            self._access.free(call)

    def renew(self) -> None:
        """Renew the commanded velocity, unless something ended the walk; due every RENEWAL while `active`."""
        with self._lock:
            if self._wanted == _STILL:
                return
            if self.guard.commanded() != self._wanted:  # it was ended, or another client walks
                self._wanted = _STILL
                return
            try:
                self._drive(self._wanted)
            except RobotError as error:
                _logger.warning("the walk ends: %s", error)
                self._wanted = _STILL

    def close(self) -> None:
        """End the walk for good."""
        self.stop()
        with self._lock:
            self._closed = True

    def _drive(self, velocity: WalkVelocity) -> None:
        self.guard.drive(asdict(velocity), CLIENT)
        self._wanted = self.guard.commanded()  # as it was limited


def _to_the_robot(at: Odometry, x: float, y: float, heading: float) -> WalkVelocity:
    """Return what is left of a way in m and rad, as the robot sees it."""
    cos, sin = math.cos(at.heading), math.sin(at.heading)
    return WalkVelocity(
        forward=cos * x + sin * y,
        left=cos * y - sin * x,
        turn=math.remainder(heading - at.heading, math.tau),
    )


def _limited(left: WalkVelocity, highest: WalkVelocity) -> WalkVelocity:
    """Return the velocity that takes away what is left, straight, within the highest of each kind."""
    wanted = [_GAIN * part for part in astuple(left)]
    scale = max(
        1.0, abs(wanted[0]) / highest.forward, abs(wanted[1]) / highest.left, abs(wanted[2]) / highest.turn
    )
    return WalkVelocity(*(part / scale for part in wanted))
