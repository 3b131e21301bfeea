"""The way to a place on the floor, as the velocity that leads a robot there from where it is."""

from __future__ import annotations

import cmath
import math
from abc import ABC, abstractmethod
from typing import Final

from naoserver.capabilities import STILL, Odometry, WalkVelocity
from naoserver.errors import InvalidCommand

_GAIN: Final = 1.5
"""Ratio of the velocity to the rest of the way, in 1/s."""
_CAUTION: Final = 0.6
"""The same times the lag of the robot: with more, it would go beyond the place."""
_PLACE_TOLERANCE: Final = 0.02
"""Distance in m, and in rad / 2, within which a place counts as reached."""
_LEAST_TURN: Final = 0.2
"""Velocity in rad/s below which a turn may come to nothing: the backlash of the legs swallows it."""
_LEAVING: Final = 3.0 * _PLACE_TOLERANCE
"""Distance in m at which a robot that has reached the place, and turns there, counts as off it again."""
_AHEAD: Final = 0.3
"""Angle in rad to the place within which a robot that cannot go sideways drives towards it."""
_EVEN: Final = 1e-6
"""Angle in rad by which driving backwards must save turning."""
_PASSED: Final = 0.1
"""Distance in m within which such a robot that has passed the place returns without turning round."""
_SPARE_TIME: Final = 10.0
"""Robot seconds that a way may take in addition to three times its duration at full speed."""

Place = tuple[float, float, float]
"""x and y in m and a heading in rad, relative to the robot's place at the start."""


def way_to(place: Place, start: Odometry, highest: WalkVelocity, lag: float = 0.0) -> Way:
    """Return the way to a place from the robot's place at `start`, at most at the velocities `highest`.

    A robot whose velocity lags behind commands, by `lag` in s, slows down earlier.

    Raises InvalidCommand for a robot that cannot get to every place: one that cannot turn, or only turns.
    """
    if not (highest.forward and highest.turn):
        what = "turn" if highest.forward else "drive forwards"
        raise InvalidCommand("walk", f"the robot cannot {what}, so it cannot go to a place")
    kind = StraightWay if highest.left else SteeredWay
    return kind(place, start, highest, lag)


class Way(ABC):
    """The way to a place: the velocities on it, asked for again and again until the robot is there."""

    def __init__(self, place: Place, start: Odometry, highest: WalkVelocity, lag: float = 0.0) -> None:
        x, y, heading = place
        self._gain = min(_GAIN, _CAUTION / lag) if lag else _GAIN
        # In the plane, x + iy.
        self._goal = complex(start.x, start.y) + cmath.rect(1.0, start.heading) * complex(x, y)
        self._heading = start.heading + heading
        self._highest = highest
        self._length = self._left(complex(x, y), heading)
        self.patience: Final = _SPARE_TIME + 3.0 * self._duration(complex(x, y), heading)
        """Robot seconds that it may take."""

    @abstractmethod
    def velocity(self, now: Odometry) -> WalkVelocity:
        """Return the velocity for the rest of the way, within the limits of each; all 0 at its end."""

    def progress(self, now: Odometry) -> float:
        """Return the completed fraction of the way."""
        left = self._left(*self._rest(now))
        return min(max(1.0 - left / max(self._length, _PLACE_TOLERANCE), 0.0), 1.0)

    @abstractmethod
    def _left(self, way: complex, turn: float) -> float:
        """Return the m and rad that are left together, given the place and the turn in the robot's frame."""

    @abstractmethod
    def _duration(self, way: complex, turn: float) -> float:
        """Return the seconds of the way at full speed."""

    def _rest(self, now: Odometry) -> tuple[complex, float]:
        """Return the place and the turn to its heading in the robot's frame."""
        way = (self._goal - complex(now.x, now.y)) * cmath.rect(1.0, -now.heading)
        return way, math.remainder(self._heading - now.heading, math.tau)


class StraightWay(Way):
    """The straight way of a robot that goes in every direction; it turns to the heading first."""

    def velocity(self, now: Odometry) -> WalkVelocity:
        way, turn = self._rest(now)
        if abs(way) < _PLACE_TOLERANCE and abs(turn) < 2 * _PLACE_TOLERANCE:
            return STILL
        highest = self._highest
        turning = min(max(self._gain * turn, -highest.turn), highest.turn)
        if abs(turn) > 2 * _PLACE_TOLERANCE:
            turning = math.copysign(max(abs(turning), min(_LEAST_TURN, highest.turn)), turn)
        # Legs do not turn and go at full speed together. It turns first: sideways it is slow.
        share = 1.0 - abs(turning) / highest.turn
        parts = (way.real, highest.forward), (way.imag, highest.left)
        gain = min((self._gain, *(share * limit / abs(part) for part, limit in parts if part)))
        forward, left = (min(max(gain * part, -limit), limit) for part, limit in parts)
        return WalkVelocity(forward, left, turning)

    def _left(self, way: complex, turn: float) -> float:
        return abs(way) + abs(turn)

    def _duration(self, way: complex, turn: float) -> float:
        highest = self._highest
        straight = math.hypot(way.real / highest.forward, way.imag / highest.left)
        return straight + abs(turn) / highest.turn


class SteeredWay(Way):
    """The way of a robot that cannot go sideways: it turns to the place, drives there, and turns again.

    It drives backwards where that takes less turning.
    """

    def __init__(self, place: Place, start: Odometry, highest: WalkVelocity, lag: float = 0.0) -> None:
        super().__init__(place, start, highest, lag)
        way, turn = self._rest(start)
        self._side = 1.0 if _turning(way, turn) <= _turning(-way, turn) + _EVEN else -1.0  # -1: backwards
        self._there = abs(way) < _PLACE_TOLERANCE

    def velocity(self, now: Odometry) -> WalkVelocity:
        way, turn = self._rest(now)
        self._there = abs(way) < (_LEAVING if self._there else _PLACE_TOLERANCE)
        if self._there:
            return STILL if abs(turn) < 2 * _PLACE_TOLERANCE else WalkVelocity(turn=self._turn(turn))
        side = self._side
        if (side * way).real < 0.0 and abs(way) < _PASSED:
            side = -side
        bearing = cmath.phase(side * way)
        if abs(bearing) > _AHEAD:
            return WalkVelocity(turn=self._turn(bearing))
        speed = min(self._gain * abs(way), self._highest.forward)
        return WalkVelocity(forward=side * speed, turn=self._turn(bearing))

    def _turn(self, angle: float) -> float:
        """Return the velocity of the turn with which to turn by an angle."""
        return min(max(self._gain * angle, -self._highest.turn), self._highest.turn)

    def _left(self, way: complex, turn: float) -> float:
        return abs(way) + min(_turning(way, turn), _turning(-way, turn))

    def _duration(self, way: complex, turn: float) -> float:
        turning = min(_turning(way, turn), _turning(-way, turn))
        return abs(way) / self._highest.forward + turning / self._highest.turn


def _turning(way: complex, turn: float) -> float:
    """Return the angle in rad by which a robot turns that drives forwards to a place, and turns there."""
    if abs(way) < _PLACE_TOLERANCE:
        return abs(turn)
    bearing = cmath.phase(way)
    return abs(bearing) + abs(math.remainder(turn - bearing, math.tau))
