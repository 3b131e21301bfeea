"""The imperfections of the sensors: noise, offsets, gains and delay, the same ones for the same seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CHANNELS: Final = 16
"""Measurements with errors: specific force (3), turning rate (3), roll and pitch (2), soles (2 x 4)."""
_BLOCK: Final = 256


@dataclass(frozen=True, slots=True)
class SenseNoise:
    """How imperfect the sensors are: standard deviations unless said otherwise."""

    acceleration: float = 0.15
    """White noise of the accelerometer in m/s2: B-Human's filter reckons with a variance of 0.0222."""
    acceleration_offset: float = 0.1
    """Offset of each axis in m/s2: the 1 % that the documentation gives, of gravity."""
    turning: float = 0.005
    """White noise of the gyrometer in rad/s: B-Human's 0.03 deg/s per root of a hertz, at 100 Hz."""
    turning_offset: float = 0.005
    """Offset of each axis in rad/s: what a calibration leaves; assumed."""
    tilt: float = 0.003
    """White noise of roll and pitch in rad; assumed."""
    tilt_offset: float = 0.01
    """Offset of each in rad: how the unit is mounted; assumed."""
    pressure: float = 0.2
    """White noise of a foot's sensor that carries something in N; assumed."""
    pressure_gain: float = 0.1
    """Error of the gain of each of a foot's sensors; assumed, after the documentation, which says that their
    sum is not accurate enough to have a meaning."""
    most_pressure: float = 25.0
    """The most that a foot's sensor tells in N: the end of its range."""
    sonar_near: float = 0.01
    """White noise of the sonar in m up to 0.8 m: the best resolution that the documentation gives."""
    sonar_far: float = 0.04
    """White noise of the sonar in m beyond: its worst."""
    delay: int = 1
    """Control ticks by which all is told late: one cycle of the bus between the boards of the body."""


class Errors:
    """The errors of each tick, one after the other."""

    def __init__(self, noise: SenseNoise, random: np.random.Generator) -> None:
        self._random = random
        white = [noise.acceleration] * 3 + [noise.turning] * 3 + [noise.tilt] * 2 + [noise.pressure] * 8
        offsets = [noise.acceleration_offset] * 3 + [noise.turning_offset] * 3 + [noise.tilt_offset] * 2
        self._white = np.array(white)
        self._offsets = np.zeros(CHANNELS)
        self._offsets[: len(offsets)] = random.normal(0.0, offsets)
        self.gains: Final[list[float]] = random.normal(1.0, noise.pressure_gain, 8).clip(0.5, 1.5).tolist()
        """Of the foot's sensors, left before right."""
        self._block: Array = np.zeros((0, CHANNELS))
        self._next = 0

    def next(self) -> Array:
        """Return the errors of the next tick, by channel."""
        if self._next == len(self._block):
            shape = (_BLOCK, CHANNELS)
            self._block = self._random.standard_normal(shape) * self._white + self._offsets
            self._next = 0
        row: Array = self._block[self._next]
        self._next += 1
        return row
