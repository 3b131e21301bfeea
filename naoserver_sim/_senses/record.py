"""The sensor readings of the last control ticks, with their errors, kept raw until they are read."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import FootReading, InertialReading
from naoserver.bodies.footsteps import Footsteps
from naoserver.bodies.parts import Sole
from naoserver.body import Body
from naoserver.protocol.failing_senses import FailingSenses
from naoserver_sim._body import SIDES
from naoserver_sim._share import RobotData

Array = NDArray[np.float64]

CHANNELS: Final = 16
"""Measurements with errors: specific force (3), turning rate (3), roll and pitch (2), soles (2 x 4)."""
_BLOCK: Final = 256


@dataclass(frozen=True, slots=True)
class SenseNoise:
    """Imperfections of the sensors: standard deviations unless said otherwise."""

    acceleration: float = 0.15
    """White noise of the accelerometer in m/s2: B-Human's filter assumes a variance of 0.0222."""
    acceleration_offset: float = 0.1
    """Offset of each axis in m/s2: 1 % of gravity, according to the documentation."""
    turning: float = 0.005
    """White noise of the gyrometer in rad/s: B-Human's 0.03 deg/s per root of a hertz, at 100 Hz."""
    turning_offset: float = 0.005
    """Offset of each axis in rad/s, after calibration; assumed."""
    tilt: float = 0.003
    """White noise of roll and pitch in rad; assumed."""
    tilt_offset: float = 0.01
    """Offset of each in rad, by the mounting of the unit; assumed."""
    pressure: float = 0.2
    """White noise of a loaded sensor of a foot in N; assumed."""
    pressure_gain: float = 0.1
    """Error of the gain of each of a foot's sensors; assumed, because according to the documentation their
    sum is too inaccurate to be meaningful."""
    most_pressure: float = 25.0
    """The largest reading of a foot's sensor in N: the end of its range."""
    sonar_near: float = 0.01
    """White noise of the sonar in m up to 0.8 m: the best resolution that the documentation gives."""
    sonar_far: float = 0.04
    """White noise of the sonar in m beyond: its worst."""
    delay: int = 1
    """Delay of all readings in control ticks: one cycle of the bus between the boards of the body."""


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
        """Gains of the foot's sensors, left before right."""
        self._block: Iterator[list[float]] = iter(())

    def next(self) -> list[float]:
        """Return the errors of the next tick, by channel."""
        if (row := next(self._block, None)) is None:
            block = self._random.standard_normal((_BLOCK, CHANNELS)) * self._white + self._offsets
            self._block = iter(block.tolist())
            row = next(self._block)
        return row


Four = tuple[float, float, float, float]


def load(foot: Sequence[float]) -> float:
    """Return the perpendicular force on a sole in N; `foot` is as in `SensorLayout.feet`."""
    pressing = -(foot[0] * foot[18] + foot[1] * foot[19] + foot[2] * foot[20])
    return pressing if pressing > 0.0 else 0.0


class SoleSensors:
    """The sensors of one sole, which share the load: the nearer its center, the more a sensor carries.

    The load is shared bilinearly, so that the sum of the four is the load, and their center of pressure is
    that of the foot if it lies between them; beyond them, the outermost sensors carry everything.
    """

    def __init__(self, sole: Sole) -> None:
        places = sole.pressure
        self._front = (places["FrontLeft"][0] + places["FrontRight"][0]) / 2
        self._rear = (places["RearLeft"][0] + places["RearRight"][0]) / 2
        # Left and right ends of the line between the front and between the rear sensors.
        self._front_ends = places["FrontLeft"][1], places["FrontRight"][1]
        self._rear_ends = places["RearLeft"][1], places["RearRight"][1]

    def pressures(self, foot: Sequence[float]) -> Four:
        """Return the loads in N of the sensors `CORNERS`; `foot` is as in `SensorLayout.feet`."""
        carried = load(foot)
        if carried == 0.0:
            return 0.0, 0.0, 0.0, 0.0
        fx, fy, fz, tx, ty, tz, px, py, pz, ox, oy, oz, ax, ay, az, bx, by, bz, *_ = foot
        rx, ry, rz = px - ox, py - oy, pz - oz
        mx, my, mz = ry * fz - rz * fy + tx, rz * fx - rx * fz + ty, rx * fy - ry * fx + tz
        # The moment about the sole's middle is that of the load at the center of pressure.
        x = (mx * bx + my * by + mz * bz) / carried
        y = -(mx * ax + my * ay + mz * az) / carried
        forward = min(max((x - self._rear) / (self._front - self._rear), 0.0), 1.0)
        left = self._rear_ends[0] + forward * (self._front_ends[0] - self._rear_ends[0])
        right = self._rear_ends[1] + forward * (self._front_ends[1] - self._rear_ends[1])
        leftward = min(max((y - right) / (left - right), 0.0), 1.0)
        front, rear = carried * forward, carried * (1.0 - forward)
        return front * leftward, front * (1.0 - leftward), rear * leftward, rear * (1.0 - leftward)


STEP: Final = math.tau / 4096
"""Resolution in rad: the 12 bits, about 0.1 degrees, that the documentation of the robot gives."""


def encoded(angles: Array) -> Array:
    """Return angles in rad at the resolution of encoders."""
    found: Array = np.rint(angles / STEP) * STEP
    return found


_FOOT: Final = 21
"""Measurements of a foot: see `SensorLayout.feet`."""


class Sample(NamedTuple):
    """The measurements of one control tick, never modified."""

    time: float
    """Robot time in s at which they were taken."""
    values: Sequence[float]
    """MuJoCo's `sensordata`; a list, because its items are read faster than those of an array."""
    errors: Sequence[float] | None
    """Noise added to them, by channel; None without noise."""
    inertial: InertialReading
    """Readings of the inertial unit, with its errors."""


class SensorRecord:
    """Keep the newest raw measurements, and convert them to readings.

    `look` is for the thread of the physics only; any thread may read `newest`.
    """

    def __init__(
        self,
        mj: mujoco.MjModel,
        body: Body,
        data: mujoco.MjData | RobotData,
        noise: SenseNoise | None = None,
        random: np.random.Generator | None = None,
        *,
        failing: FailingSenses | None = None,
    ) -> None:
        self._failing = failing
        self._measured = data.sensordata  # a view

        def at(sensor: str) -> int:
            return int(mj.sensor(sensor).adr[0])

        # Where the measurements begin in `sensordata`.
        self._acceleration = at("acceleration")
        self._turning = at("turning")
        self._attitude = at("attitude")
        soles = body.soles
        self._feet = [at(f"{side} wrench") for side, _ in zip(SIDES, soles, strict=False)]
        self._felt = {name: at(name) for name, touch in body.touch.items() if touch.field}
        self._soles = [SoleSensors(sole) for sole in soles if sole.pressure]
        # A step of a heavy robot shakes its trunk within a tick: its gyroscope reports the mean of a tick.
        self._averages = isinstance(body.walk, Footsteps)
        self._last_attitude: tuple[Sequence[float], float] = (math.nan,) * 4, 0.0
        self._noise = noise
        self._errors = None if noise is None else Errors(noise, random or np.random.default_rng())
        self._samples: deque[Sample] = deque(maxlen=1 + (noise.delay if noise else 0))
        self.newest: Sample
        """The newest available measurements: with noise, they are delayed."""
        self.sample(0.0)

    def sample(self, time: float) -> None:
        """Record the measurements at the end of a control tick."""
        errors = None if self._errors is None else self._errors.next()
        values: list[float] = self._measured.tolist()
        if self._averages:
            values[self._turning : self._turning + 3] = self._mean_turning(time, values)
        inertial = self._inertial(values, errors)
        if self._failing is not None and self._failing.active:
            inertial = self._failing.inertial(inertial, time)
            if self._soles:
                self._fail_feet(self._failing, values)
        self._samples.append(Sample(time, values, errors, inertial))
        self.newest = self._samples[0]

    def _fail_feet(self, failing: FailingSenses, values: list[float]) -> None:
        """Measure at the soles what their sensors report."""
        left, right = (slice(begin, begin + _FOOT) for begin in self._feet)
        before = values[left], values[right]
        if (feet := failing.feet(before, [0.0] * _FOOT)) is not before:
            values[left], values[right] = feet

    def begin_again(self) -> None:
        """Forget what was measured: the robot is placed elsewhere, and has not turned."""
        for _ in tuple(self._samples):
            self.sample(self._samples[-1].time)

    def _mean_turning(self, time: float, values: Sequence[float]) -> Sequence[float]:
        """Return the mean turning rate in rad/s since the last reading."""
        attitude = values[self._attitude : self._attitude + 4]
        before, since = self._last_attitude
        self._last_attitude = attitude, time
        if time <= since:
            return values[self._turning : self._turning + 3]
        # The turn from one attitude to the other, as a quaternion.
        (aw, ax, ay, az), (bw, bx, by, bz) = attitude, before
        w = bw * aw + bx * ax + by * ay + bz * az
        x = bw * ax - bx * aw - by * az + bz * ay
        y = bw * ay + bx * az - by * aw - bz * ax
        z = bw * az - bx * ay + by * ax - bz * aw
        sine = math.copysign(math.hypot(x, y, z), w)
        rate = (2.0 * math.atan2(abs(sine), abs(w)) / sine if sine else 2.0) / (time - since)
        return rate * x, rate * y, rate * z

    def _inertial(self, values: Sequence[float], errors: Sequence[float] | None) -> InertialReading:
        w, x, y, z = values[self._attitude : self._attitude + 4]
        roll = math.atan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - x * z))))
        ax, ay, az = values[self._acceleration : self._acceleration + 3]
        tx, ty, tz = values[self._turning : self._turning + 3]
        if errors is None:
            return InertialReading((ax, ay, az), (tx, ty, tz), roll, pitch)
        fx, fy, fz, rx, ry, rz, of_roll, of_pitch = errors[:8]
        force, turning = (ax + fx, ay + fy, az + fz), (tx + rx, ty + ry, tz + rz)
        return InertialReading(force, turning, roll + of_roll, pitch + of_pitch)

    def felt(self, sample: Sample) -> dict[str, float]:
        """Return the forces in N on the touch sensors that feel contacts."""
        return {name: sample.values[at] for name, at in self._felt.items()}

    def encoded(self, angles: Array) -> Array:
        """Return angles of joints in rad as they are measured: with noise, at the resolution of encoders."""
        return angles if self._noise is None else encoded(angles)

    def feet(self, sample: Sample | None = None) -> tuple[FootReading, FootReading]:
        """Return the readings of the sensors of the left and of the right sole; all 0 without sensors."""
        if not self._soles:
            return FootReading(), FootReading()
        sample = sample or self.newest
        return FootReading(*self._pressures(sample, 0)), FootReading(*self._pressures(sample, 1))

    def loads(self) -> tuple[float, float]:
        """Return the loads of the left and of the right sole in N: the sums of their sensors."""
        sample = self.newest
        if sample.errors is None or not self._soles:
            return load(self._wrench(sample, 0)), load(self._wrench(sample, 1))
        return sum(self._pressures(sample, 0)), sum(self._pressures(sample, 1))

    def weight(self) -> float:
        """Return the force in N with which both feet together press downwards."""
        values = self.newest.values
        return -sum([values[foot + 2] for foot in self._feet])

    def _wrench(self, sample: Sample, foot: int) -> Sequence[float]:
        begin = self._feet[foot]
        return sample.values[begin : begin + _FOOT]

    def _pressures(self, sample: Sample, foot: int) -> Sequence[float]:
        """Return the readings of a sole's sensors in N."""
        pressures = self._soles[foot].pressures(self._wrench(sample, foot))
        if self._noise is None or self._errors is None or sample.errors is None:
            return pressures
        first, most = 4 * foot, self._noise.most_pressure
        gains, errors = self._errors.gains[first : first + 4], sample.errors[8 + first : 12 + first]
        return [
            min(max(gain * pressure + error, 0.0), most) if pressure > 0.0 else 0.0
            for gain, pressure, error in zip(gains, pressures, errors, strict=True)
        ]
