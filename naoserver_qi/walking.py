"""Walk for clients of NAOqi, who command a velocity once and expect the robot to keep it."""

from __future__ import annotations

import cmath
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

    def go_to(self, call: Call, x: float, y: float, heading: float, start: Odometry) -> bool:
        """Walk to a place in m and rad as the robot stood at `start`; return whether it came."""
        guard = self.guard
        # In the plane, x + iy.
        goal = complex(start.x, start.y) + cmath.rect(1.0, start.heading) * complex(x, y)
        highest = WalkVelocity(*(_SHARE * limit for limit in astuple(guard.limits)))
        patience = _PATIENCE + 3.0 * (
            math.hypot(x / highest.forward, y / highest.left) + abs(heading) / highest.turn
        )
        begin, began = guard.read().time, False
        try:
            while not call.stopped.is_set():
                now = guard.read()
                way = (goal - complex(now.x, now.y)) * cmath.rect(1.0, -now.heading)
                turn = math.remainder(start.heading + heading - now.heading, math.tau)
                if abs(way) < _CLOSE and abs(turn) < 2 * _CLOSE:
                    return True
                if now.time - begin > patience or (began and not self.active):
                    return False
                self.go(_limited((way.real, way.imag, turn), highest))
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


def _limited(left: tuple[float, float, float], highest: WalkVelocity) -> WalkVelocity:
    """Return the velocity that takes away what is left in m and rad, straight, within the highest of each."""
    wanted = [_GAIN * part for part in left]
    shares = (abs(part) / limit for part, limit in zip(wanted, astuple(highest), strict=True))
    scale = max(1.0, *shares)
    return WalkVelocity(*(part / scale for part in wanted))
