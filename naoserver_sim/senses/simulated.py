"""The senses of the simulated robot, as the server asks for them, and what feeds them at each tick."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.body import H25, Body
from naoserver.capabilities import SenseReading, SonarReading
from naoserver_sim.model import Model
from naoserver_sim.senses.battery import Battery
from naoserver_sim.senses.falls import FallManager
from naoserver_sim.senses.noise import SenseNoise
from naoserver_sim.senses.record import Sample, SensorRecord
from naoserver_sim.senses.sonar import PERIOD, RANGE, Sonar
from naoserver_sim.senses.touch import Touch
from naoserver_sim.simulator import Simulator

Array = NDArray[np.float64]

_NEAR: Final = 0.8
"""Distance in m up to which the sonar is precise."""
_FALLS_EVERY: Final = 2
"""Control ticks between two looks of the fall manager: 50 Hz, the cycle of NAOqi's motion."""


class SimulatedSenses:
    """Feel what a Nao feels.

    Implements `naoserver.capabilities.Senses` and `naoserver_sim.simulator.Watcher`. With `noise` every sense
    is as imperfect as that says, drawn from `random`; the same numbers at the same ticks from the same seed.
    """

    def __init__(
        self,
        model: Model,
        data: mujoco.MjData,
        simulator: Simulator,
        *,
        noise: SenseNoise | None = None,
        random: np.random.Generator | None = None,
        body: Body = H25,
    ) -> None:
        self._data = data
        self._simulator = simulator
        self._noise = noise
        self._random = random if random is not None else np.random.default_rng()
        self.record: Final = SensorRecord(model.mj, data, noise, self._random, body)
        """What the sensors told at the last ticks: what a controller asks at every tick."""
        self._battery = Battery(model.robot, body)
        self._sonar = Sonar(model.mj, body)
        self._touch = Touch()
        self.falls: Final = FallManager(self._go_limp)
        """What notices that the robot falls."""
        self._motors = np.unique(model.robot.motors)
        self._sonar_every = round(PERIOD / simulator.tick_period)
        self._ticks = 0
        self._ping: tuple[Array, list[float]] = (data.qpos.copy(), [0.0, 0.0])
        self._echo: tuple[Array, SonarReading] | None = None
        self._cached: tuple[Sample, SenseReading] | None = None

    @property
    def touch_names(self) -> tuple[str, ...]:
        """The touch sensors."""
        return H25.touch_sensors

    @property
    def sonar_range(self) -> tuple[float, float]:
        """Nearest and farthest distance that the sonar tells in m."""
        return RANGE

    @property
    def sonar_cone(self) -> float:
        """Full angle of the sonar's cone in rad."""
        return self._sonar.cone

    def read(self) -> SenseReading:
        """Return the newest snapshot."""
        self._simulator.newest()  # a virtual clock's time is caught up with
        sample = self.record.newest
        touched = self._touch.touched(sample.time, self.record.bumps(sample))
        cached = self._cached
        if cached is not None and cached[0] is sample:
            reading = cached[1]
            return reading if reading.touched == touched else replace(reading, touched=touched)
        left, right = self.record.feet(sample)
        reading = SenseReading(
            time=sample.time,
            inertial=self.record.inertial(sample),
            left_foot=left,
            right_foot=right,
            sonar=self._listen(),
            touched=touched,
            battery=self._battery.reading,
        )
        self._cached = (sample, reading)
        return reading

    def press(self, sensor: str, seconds: float) -> None:
        """Press a touch sensor for some seconds from now on. Raises InvalidCommand when there is no such."""
        self._touch.press(sensor, self._simulator.newest().time, seconds)

    def look(self, time: float) -> None:
        """Take in what is measured at the end of a control tick; belongs to the thread of the physics."""
        self.record.look(time)
        self._ticks += 1
        period = self._simulator.tick_period
        if self._ticks % _FALLS_EVERY == 0:
            self.falls.look(time, period * _FALLS_EVERY, self.record.leaning(), self.record.weight())
        if self._ticks % self._sonar_every == 0:
            data = self._data
            self._battery.draw(period * self._sonar_every, data.actuator_force, data.qvel)
            errors = self._random.standard_normal(2).tolist() if self._noise else [0.0, 0.0]
            self._ping = (data.qpos.copy(), errors)

    def _go_limp(self, seconds: float) -> None:
        self._simulator.motors.stiffen(self._motors, np.zeros(len(self._motors)), seconds)

    def _listen(self) -> SonarReading:
        """Return what the sonar measured last: worked out once, when it is asked for."""
        qpos, errors = self._ping
        echo = self._echo
        if echo is None or echo[0] is not qpos:
            heard = self._sonar.measure(qpos)
            left, right = (
                self._blur(distance, error)
                for distance, error in zip((heard.left, heard.right), errors, strict=True)
            )
            self._echo = echo = (qpos, SonarReading(left, right))
        return echo[1]

    def _blur(self, distance: float, error: float) -> float:
        if self._noise is None or not math.isfinite(distance):
            return distance
        noise = self._noise.sonar_near if distance <= _NEAR else self._noise.sonar_far
        return min(max(distance + noise * error, RANGE[0]), RANGE[1])
