"""Angles over time, as NAOqi's interpolations ask for them: smooth through keys, or along Bezier curves."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Protocol

from naoserver.errors import InvalidCommand

__all__ = ["BezierKey", "BezierTrajectory", "SmoothTrajectory", "Trajectory", "check_times"]

_BISECTIONS: Final = 30


class Trajectory(Protocol):
    """An angle in rad for each moment from 0 to `duration` in s; before and after, the first and last one."""

    @property
    def duration(self) -> float:
        """When the last key is reached in s."""
        ...

    def at(self, time: float) -> float:
        """Return the angle at a time."""
        ...


def check_times(joint: str, times: Sequence[float], count: int) -> None:
    """Raise InvalidCommand unless there are `count` times, above 0 and increasing."""
    if len(times) != count or not times:
        raise InvalidCommand(joint, f"{joint}: there are {len(times)} times for {count} keys")
    if times[0] <= 0.0 or any(later <= time for time, later in pairwise(times)):
        raise InvalidCommand(joint, f"{joint}: the times must be above 0 and increase, not {list(times)}")


class SmoothTrajectory:
    """Go through keys by cubic pieces, at rest at both ends, without swinging beyond a key.

    The slope at an inner key is the harmonic mean of those beside it, 0 where the angle turns back: Fritsch
    and Butland, SIAM J. Sci. Stat. Comput. 5 (1984).
    """

    def __init__(self, joint: str, start: float, times: Sequence[float], angles: Sequence[float]) -> None:
        """Begin at `start` at time 0. Raises InvalidCommand unless the times increase, one for each angle."""
        check_times(joint, times, len(angles))
        self._times = (0.0, *times)
        self._angles = (start, *angles)
        rises = [
            (self._angles[i + 1] - self._angles[i]) / (self._times[i + 1] - self._times[i])
            for i in range(len(times))
        ]
        inner = [
            2.0 * before * after / (before + after) if before * after > 0.0 else 0.0
            for before, after in pairwise(rises)
        ]
        self._slopes = (0.0, *inner, 0.0)

    @property
    def duration(self) -> float:
        """When the last key is reached in s."""
        return self._times[-1]

    def at(self, time: float) -> float:
        """Return the angle at a time."""
        if time <= 0.0:
            return self._angles[0]
        if time >= self.duration:
            return self._angles[-1]
        i = bisect_right(self._times, time) - 1
        span = self._times[i + 1] - self._times[i]
        s = (time - self._times[i]) / span
        return (
            (1.0 + 2.0 * s) * (1.0 - s) ** 2 * self._angles[i]
            + s * (1.0 - s) ** 2 * span * self._slopes[i]
            + s * s * (3.0 - 2.0 * s) * self._angles[i + 1]
            + s * s * (s - 1.0) * span * self._slopes[i + 1]
        )


@dataclass(frozen=True, slots=True)
class BezierKey:
    """A key of a curve, and its handles: each a time in s and an angle in rad beside those of the key."""

    time: float
    angle: float
    before: tuple[float, float] = (0.0, 0.0)
    after: tuple[float, float] = (0.0, 0.0)


class BezierTrajectory:
    """Follow cubic Bezier curves from key to key, as Choregraphe draws them."""

    def __init__(self, joint: str, start: float, keys: Sequence[BezierKey]) -> None:
        """Begin at `start` at time 0. Raises InvalidCommand unless the times of the keys increase."""
        check_times(joint, [key.time for key in keys], len(keys))
        self._keys = (BezierKey(0.0, start), *keys)
        self._times = [key.time for key in self._keys]

    @property
    def duration(self) -> float:
        """When the last key is reached in s."""
        return self._times[-1]

    def at(self, time: float) -> float:
        """Return the angle at a time."""
        if time <= 0.0:
            return self._keys[0].angle
        if time >= self.duration:
            return self._keys[-1].angle
        i = bisect_right(self._times, time) - 1
        begin, end = self._keys[i], self._keys[i + 1]
        span = end.time - begin.time
        # Within the piece, so that the time along the curve never runs backwards.
        times = (
            0.0,
            min(max(begin.after[0], 0.0), span),
            span + max(min(end.before[0], 0.0), -span),
            span,
        )
        angles = (begin.angle, begin.angle + begin.after[1], end.angle + end.before[1], end.angle)
        low, high = 0.0, 1.0
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2
            if _bernstein(times, middle) < time - begin.time:
                low = middle
            else:
                high = middle
        return _bernstein(angles, high)


def _bernstein(values: tuple[float, float, float, float], s: float) -> float:
    r = 1.0 - s
    return (
        r * r * r * values[0]
        + 3.0 * r * r * s * values[1]
        + 3.0 * r * s * s * values[2]
        + s * s * s * values[3]
    )
