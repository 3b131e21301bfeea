"""A motion as key frames: where each joint is to be when."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from types import MappingProxyType
from typing import Final


class Interpolation(StrEnum):
    """How a joint comes to a key from the one before."""

    SMOOTH = "smooth"
    """From rest to rest with the least jerk: the quintic polynomial of Flash and Hogan (1985)."""
    LINEAR = "linear"

    def ease(self, part: float) -> float:
        """Return how much of the way is done, from 0 to 1, when a part of the time has passed."""
        if self is Interpolation.LINEAR:
            return part
        return part**3 * (10.0 - 15.0 * part + 6.0 * part**2)

    @property
    def peak(self) -> float:
        """The highest speed on the way as a multiple of the mean one."""
        return _PEAKS[self]


_PEAKS: Final = {Interpolation.SMOOTH: 1.875, Interpolation.LINEAR: 1.0}


@dataclass(frozen=True, slots=True)
class Key:
    """Where a joint is to be at a time after the beginning of the motion."""

    time: float
    """In s, above 0."""
    angle: float | None
    """In rad; of a hand from 0 to 1; None where it was when the motion began."""
    interpolation: Interpolation = Interpolation.SMOOTH


@dataclass(frozen=True)
class Motion:
    """A motion of some joints. A joint goes from key to key, first of all from where it is."""

    name: str
    keys: Mapping[str, tuple[Key, ...]]
    """The keys of each joint that moves, in the order of their times."""
    description: str = ""
    start: str = ""
    """The posture in which it begins; empty when it begins in any."""
    end: str = ""
    """The posture in which it ends; empty when it ends in the one in which it began."""
    _times: Mapping[str, tuple[float, ...]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        times = {joint: tuple(key.time for key in keys) for joint, keys in self.keys.items()}
        object.__setattr__(self, "_times", MappingProxyType(times))

    @cached_property
    def duration(self) -> float:
        """Seconds from the beginning to the last key."""
        return max(keys[-1].time for keys in self.keys.values())

    def at(self, time: float, begin: Mapping[str, float]) -> dict[str, float]:
        """Return the angles at a time after the beginning, at which the joints were at `begin`."""
        return {joint: self._angle(joint, time, begin[joint]) for joint in self.keys}

    def _angle(self, joint: str, time: float, begin: float) -> float:
        keys, place = self.keys[joint], bisect_left(self._times[joint], time)
        since, before = (keys[place - 1].time, _known(keys[place - 1], begin)) if place else (0.0, begin)
        if place == len(keys):
            return before
        after = keys[place]
        part = max(0.0, time - since) / (after.time - since)
        return before + (_known(after, begin) - before) * after.interpolation.ease(part)


def _known(key: Key, begin: float) -> float:
    return begin if key.angle is None else key.angle
