"""What the sensors told at the last control ticks, kept as raw as it came until somebody asks."""

from __future__ import annotations

import math
from collections import deque
from typing import Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.body import H25, Body
from naoserver.capabilities import FootReading, InertialReading, Vector
from naoserver_sim.senses.feet import SoleSensors, load
from naoserver_sim.senses.noise import Errors, SenseNoise
from naoserver_sim.senses.sensors import SIDES, SensorLayout

Array = NDArray[np.float64]

_FOOT: Final = 21
"""Measurements of a foot: see `SensorLayout.feet`."""


class Sample(NamedTuple):
    """The measurements of one control tick. Its arrays are never written to again."""

    time: float
    """Robot time in s at which they were taken."""
    values: Array
    """MuJoCo's `sensordata`."""
    errors: Array | None
    """What is added to them, by channel; None without noise."""


class SensorRecord:
    """Keep the newest measurements, and tell what they mean.

    Implements `naoserver_sim.simulator.Watcher`. `look` belongs to the thread of the physics; `newest` may be
    read by any thread.
    """

    def __init__(
        self,
        mj: mujoco.MjModel,
        data: mujoco.MjData,
        noise: SenseNoise | None = None,
        random: np.random.Generator | None = None,
        body: Body = H25,
    ) -> None:
        self._data = data
        self._layout = SensorLayout.of(mj)
        self._soles = tuple(SoleSensors(body, side) for side in SIDES)
        self._noise = noise
        self._errors = None if noise is None else Errors(noise, random or np.random.default_rng())
        self._samples: deque[Sample] = deque(maxlen=1 + (noise.delay if noise else 0))
        self.newest: Sample
        """The newest measurements that have come through: late when there is noise."""
        self.look(0.0)

    def look(self, time: float) -> None:
        """Take the measurements at the end of a control tick."""
        errors = None if self._errors is None else self._errors.next()
        self._samples.append(Sample(time, self._data.sensordata.copy(), errors))
        self.newest = self._samples[0]

    def turning(self, sample: Sample | None = None) -> Vector:
        """Return the turning rate of the torso in rad/s about its own axes."""
        return _vector(sample or self.newest, self._layout.turning, 3)

    def tilt(self, sample: Sample | None = None) -> tuple[float, float]:
        """Return roll, positive to the right side, and pitch, positive forwards, of the torso in rad."""
        sample = sample or self.newest
        begin = self._layout.attitude
        w, x, y, z = sample.values[begin : begin + 4].tolist()
        roll = math.atan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - x * z))))
        if sample.errors is not None:
            roll_error, pitch_error = sample.errors[6:8].tolist()
            return roll + roll_error, pitch + pitch_error
        return roll, pitch

    def leaning(self) -> float:
        """Return the angle between the torso's z axis and the vertical in rad."""
        roll, pitch = self.tilt()
        return math.acos(max(-1.0, min(1.0, math.cos(roll) * math.cos(pitch))))

    def bumps(self, sample: Sample) -> tuple[float, ...]:
        """Return the forces on the bumpers in N."""
        return tuple(float(sample.values[bumper]) for bumper in self._layout.bumpers)

    def inertial(self, sample: Sample | None = None) -> InertialReading:
        """Return what the inertial unit tells."""
        sample = sample or self.newest
        roll, pitch = self.tilt(sample)
        force = _vector(sample, self._layout.acceleration, 0)
        return InertialReading(force, self.turning(sample), roll, pitch)

    def feet(self, sample: Sample | None = None) -> tuple[FootReading, FootReading]:
        """Return what the sensors of the left and of the right sole tell."""
        sample = sample or self.newest
        return self._foot(sample, 0), self._foot(sample, 1)

    def loads(self) -> tuple[float, float]:
        """Return what the left and the right sole carry in N: the sums of what their sensors tell."""
        sample = self.newest
        if sample.errors is None:
            return load(self._wrench(sample, 0)), load(self._wrench(sample, 1))
        left, right = self.feet(sample)
        return left.total, right.total

    def weight(self) -> float:
        """Return the force in N with which both feet together press downwards."""
        left, right = self._layout.feet
        values = self.newest.values
        return -float(values[left + 2] + values[right + 2])

    def _wrench(self, sample: Sample, foot: int) -> list[float]:
        begin = self._layout.feet[foot]
        wrench: list[float] = sample.values[begin : begin + _FOOT].tolist()
        return wrench

    def _foot(self, sample: Sample, foot: int) -> FootReading:
        pressures = self._soles[foot].pressures(self._wrench(sample, foot))
        if self._noise is None or self._errors is None or sample.errors is None:
            return FootReading(*pressures)
        first = 4 * foot
        most = self._noise.most_pressure
        errors = sample.errors[8 + first : 12 + first].tolist()
        told = [
            min(max(gain * pressure + error, 0.0), most) if pressure > 0.0 else 0.0
            for gain, pressure, error in zip(
                self._errors.gains[first : first + 4], pressures, errors, strict=True
            )
        ]
        return FootReading(*told)


def _vector(sample: Sample, begin: int, channel: int) -> Vector:
    x, y, z = sample.values[begin : begin + 3].tolist()
    if sample.errors is None:
        return x, y, z
    ex, ey, ez = sample.errors[channel : channel + 3].tolist()
    return x + ex, y + ey, z + ez
