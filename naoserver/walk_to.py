"""A walk to a place: the velocity on the way there, renewed through the guard until it is there."""

from __future__ import annotations

import cmath
import math
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, astuple
from typing import Final

from msgspec.structs import replace

from interfaces.nao import ActionState, ActionStatus
from naoserver.capabilities import Odometry, WalkVelocity
from naoserver.errors import InvalidCommand, RobotError
from naoserver.walk_guard import WalkGuard

PERIOD: Final = 0.05
"""Robot seconds between two corrections of the velocity."""
_GAIN: Final = 1.5
"""Velocity in 1/s relative to the rest of the way."""
_CLOSE: Final = 0.02
"""Distance in m, and in rad / 2, within which a place counts as reached."""
_PATIENCE: Final = 10.0
"""Robot seconds that a way may take beside three times what it takes at full speed."""
_STILL: Final = WalkVelocity()
_IDLE: Final = ActionState(time=0.0, name="", status=ActionStatus.Idle, progress=0.0, message="", count=0)


class Way:
    """The straight way to x and y in m and a heading in rad as the robot stood at `start`."""

    def __init__(self, place: tuple[float, float, float], start: Odometry, highest: WalkVelocity) -> None:
        x, y, heading = place
        # In the plane, x + iy.
        self._goal = complex(start.x, start.y) + cmath.rect(1.0, start.heading) * complex(x, y)
        self._heading = start.heading + heading
        self._highest = highest
        self._length = abs(complex(x, y)) + abs(heading)
        self.patience: Final = _PATIENCE + 3.0 * (
            math.hypot(x / highest.forward, y / highest.left) + abs(heading) / highest.turn
        )
        """Robot seconds that it may take."""

    def velocity(self, now: Odometry) -> WalkVelocity:
        """Return the velocity for the rest of the way, within the highest of each; all 0 at its end."""
        way, turn = self._rest(now)
        if abs(way) < _CLOSE and abs(turn) < 2 * _CLOSE:
            return _STILL
        parts = list(zip((way.real, way.imag, turn), astuple(self._highest), strict=True))
        gain = min(_GAIN, *(limit / abs(part) for part, limit in parts if part))
        return WalkVelocity(*(min(max(gain * part, -limit), limit) for part, limit in parts))

    def progress(self, now: Odometry) -> float:
        """Return which share of the way is behind it."""
        way, turn = self._rest(now)
        return min(max(1.0 - (abs(way) + abs(turn)) / max(self._length, _CLOSE), 0.0), 1.0)

    def _rest(self, now: Odometry) -> tuple[complex, float]:
        way = (self._goal - complex(now.x, now.y)) * cmath.rect(1.0, -now.heading)
        return way, math.remainder(self._heading - now.heading, math.tau)


class WalkTo:
    """Walk to places through `guard`; `tick` is due every PERIOD of robot time while it is `busy`.

    `on_begin` is called when it begins. Safe to use from any thread.
    """

    def __init__(
        self, guard: WalkGuard, robot_time: Callable[[], float], on_begin: Callable[[], None]
    ) -> None:
        self._guard = guard
        self._robot_time = robot_time
        self._on_begin = on_begin
        self._lock = threading.Lock()
        self._way: Way | None = None
        self._client = ""
        self._commanded = _STILL
        self._end = math.inf
        self._state = _IDLE

    @property
    def busy(self) -> bool:
        """Whether it is on the way, or ends the walk there."""
        return self._way is not None

    def state(self) -> ActionState:
        """Return how the newest walk to a place goes."""
        return replace(self._state, time=self._robot_time())

    def begin(self, way: Way, client: str) -> None:
        """Begin to walk to the end of a way instead of another.

        Raises InvalidCommand when the robot cannot walk now, CommandRefused when the client may not command.
        """
        with self._lock:
            self._drive(way, client, None)
            self._way, self._client, self._end = way, client, self._robot_time() + way.patience
            self._state = replace(_IDLE, status=ActionStatus.Moving, count=self._state.count + 1)
        self._on_begin()

    def stop(self) -> None:
        """End the walk on both feet."""
        with self._lock:
            self._guard.stop()
            if self._way is not None:
                self._commanded = _STILL
                self._state = replace(self._state, message="stopped")

    def tick(self) -> None:
        """Correct and renew the velocity; end the walk at the end of the way."""
        with self._lock:
            way = self._way
            if way is None:
                return
            try:
                if self._commanded != _STILL:
                    self._go_on(way)
            except RobotError as error:
                self._finish(ActionStatus.Stopped, str(error))
                with suppress(InvalidCommand):  # another one walks, or nobody
                    self._guard.drive(asdict(_STILL), self._client, after=self._commanded)
            # The legs are free once the guard has nothing to watch.
            if self._commanded == _STILL and self._guard.watch() is None:
                self._finish(ActionStatus.Stopped if self._state.message else ActionStatus.Done)

    def _go_on(self, way: Way) -> None:
        self._state = replace(self._state, progress=way.progress(self._guard.read()))
        if self._robot_time() > self._end:
            raise RobotError(f"it did not get there within {way.patience:.0f} s")
        self._drive(way, self._client, self._commanded)

    def _drive(self, way: Way, client: str, after: WalkVelocity | None) -> None:
        self._guard.drive(asdict(way.velocity(self._guard.read())), client, after=after)
        self._commanded = self._guard.commanded()  # as it was limited

    def _finish(self, status: ActionStatus, message: str = "") -> None:
        self._way = None
        progress = 1.0 if status is ActionStatus.Done else self._state.progress
        message = message or self._state.message
        self._state = replace(self._state, status=status, message=message, progress=progress)
