"""A motion as key frames: the targets of joints at times, and the ways between them."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property

from naoserver.errors import RobotError


class Interpolation(StrEnum):
    """Interpolation of a joint from one key to the next."""

    SMOOTH = "smooth"
    """From rest to rest with the least jerk: the quintic polynomial of Flash and Hogan (1985)."""
    LINEAR = "linear"

    def ease(self, part: float) -> float:
        """Return the completed fraction of the way when a fraction of the time has passed."""
        if self is Interpolation.LINEAR:
            return part
        return part**3 * (10.0 - 15.0 * part + 6.0 * part**2)

    @property
    def peak(self) -> float:
        """The highest speed on the way as a multiple of the mean one."""
        return 1.0 if self is Interpolation.LINEAR else 1.875


@dataclass(frozen=True, slots=True)
class Key:
    """Target of a joint at a time after the beginning of the motion."""

    time: float
    """In s, above 0."""
    angle: float | None
    """In rad; of a hand from 0 to 1; None: where it was when the motion began."""
    interpolation: Interpolation = Interpolation.SMOOTH


@dataclass(frozen=True)
class Motion:
    """A motion of some joints. Each joint goes from where it is to its first key, then from key to key."""

    name: str
    keys: Mapping[str, tuple[Key, ...]]
    """The keys of each joint that moves, in the order of their times."""
    description: str = ""
    start: str = ""
    """The posture in which it begins; empty when it begins in any."""
    end: str = ""
    """The posture in which it ends; empty when it ends in the one in which it began."""

    def of(self, joints: Collection[str]) -> Motion:
        """Return the motion without joints that a body lacks. Raises RobotError when it moves no others."""
        keys = {joint: keys for joint, keys in self.keys.items() if joint in joints}
        if not keys:
            raise RobotError(f"{self.name} moves only joints that the robot lacks: {', '.join(self.keys)}")
        return self if len(keys) == len(self.keys) else replace(self, keys=keys)

    @cached_property
    def duration(self) -> float:
        """Seconds from the beginning to the last key."""
        return max(keys[-1].time for keys in self.keys.values())

    def at(self, time: float, begin: Mapping[str, float]) -> dict[str, float]:
        """Return the angles at a time after the beginning; `begin` are the angles at the beginning."""
        return {joint: self._angle(joint, time, begin[joint]) for joint in self.keys}

    def _angle(self, joint: str, time: float, begin: float) -> float:
        keys = self.keys[joint]
        place = bisect_left(keys, time, key=lambda key: key.time)
        since, before = (keys[place - 1].time, _known(keys[place - 1], begin)) if place else (0.0, begin)
        if place == len(keys):
            return before
        after = keys[place]
        part = max(0.0, time - since) / (after.time - since)
        return before + (_known(after, begin) - before) * after.interpolation.ease(part)


def _known(key: Key, begin: float) -> float:
    return begin if key.angle is None else key.angle
