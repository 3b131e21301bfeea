"""The senses of the simulated robot for the server; with its sonar, battery, fall manager and touch.

The sonar casts rays in two cones against the robot's surroundings. Sound that meets the floor at a flat angle
is reflected away from the robot, so it gives no echo; neither does the robot's own body.
"""

from __future__ import annotations

import copy
import logging
import math
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import mujoco
import numpy as np

from naoserver.bodies.capabilities import BatteryReading, InertialReading, SenseReading, SonarReading
from naoserver.bodies.kinematics import matrix_of
from naoserver.bodies.parts import Battery, FallRules, Sonar
from naoserver.body import Body
from naoserver.errors import InvalidCommand
from naoserver.protocol.failing_senses import FailingSenses
from naoserver_sim._motors import AMBIENT, Array
from naoserver_sim._senses.record import Sample, SenseNoise, SensorRecord
from naoserver_sim._simulator import Simulator
from naoserver_sim.model import DeviceIndex, Model

PERIOD: Final = 0.1
"""Seconds between two measurements."""
_WIDE_RAYS: Final = 256
"""Rays of a cone, 3.3 degrees apart. An extra ray to each object ensures that small ones are not missed."""
_NARROW_RAYS: Final = 64
_NARROW: Final = math.radians(6)
"""Full angle of the cone in which the nearest echo is measured again."""
_SURROUNDINGS: Final = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)
"""The groups of geoms that give an echo: not those of the robot."""
_GRAZING: Final = math.cos(math.radians(45))
"""Cosine of the angle to its normal beyond which a plane reflects the sound away."""


class SonarModel:
    """Measure the nearest echo of the left and the right transducer. Thread-safe."""

    def __init__(
        self, mj: mujoco.MjModel, root: str, facts: Sonar, others: Collection[int] = frozenset()
    ) -> None:
        """`root` is the robot's link in the whole model, `others` are the links of other robots there."""
        self._facts = facts
        self._lock = threading.Lock()
        self._root = mj.body(root).id
        if others:
            # For its ears only, their contact shapes are things; its own remain unheard.
            mj = copy.copy(mj)
            mj.geom_group[np.isin(mj.geom_bodyid, list(others)) & (mj.geom_contype != 0)] = 0
        self._mj = mj
        self._things = np.flatnonzero((mj.geom_group == 0) & (mj.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
        self._planes = mj.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
        self._wide = _cone(facts.cone, _WIDE_RAYS)
        self._narrow = _cone(_NARROW, _NARROW_RAYS)
        self._transducers = [
            (np.array(place.position), matrix_of((0.0, 0.0, 0.0, *place.angles))[:3, :3])
            for place in (facts.left, facts.right)
        ]

    @cached_property
    def _data(self) -> mujoco.MjData:
        return mujoco.MjData(self._mj)  # at the first measurement, because most robots in tests never measure

    def measure(self, qpos: Array) -> SonarReading:
        """Return the distances in a state; infinite where nothing is in range."""
        with self._lock:
            self._data.qpos[:] = qpos
            mujoco.mj_kinematics(self._mj, self._data)
            left, right = (self._nearest(place, turn) for place, turn in self._transducers)
        return SonarReading(left, right)

    def _nearest(self, place: Array, turn: Array) -> float:
        """Return the smallest distance: first roughly, then around the nearest echo."""
        data = self._data
        axes = data.xmat[self._root].reshape(3, 3)
        begin = data.xpos[self._root] + axes @ place
        axes = axes @ turn
        rays = np.vstack([self._wide, self._within_cone((data.geom_xpos[self._things] - begin) @ axes)])
        distance, ray = self._cast(begin, rays @ axes.T)
        if not math.isfinite(distance):
            return math.inf
        closer = np.vstack([rays[ray], self._within_cone(self._narrow @ _turned_to(rays[ray]).T)])
        distance = min(distance, self._cast(begin, closer @ axes.T)[0])
        return max(distance, self._facts.nearest)

    def _within_cone(self, rays: Array) -> Array:
        """Return those of some rays in the transducer's frame that are within its cone, as unit vectors."""
        directions = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        within: Array = directions[directions[:, 0] >= math.cos(self._facts.cone / 2)]
        return within

    def _cast(self, begin: Array, directions: Array) -> tuple[float, int]:
        """Return the distance to the nearest echo, infinite when there is none, and along which direction."""
        mj, data = self._mj, self._data
        far = self._facts.farthest
        count, flat = len(directions), np.ascontiguousarray(directions).ravel()
        geoms = np.zeros(count, dtype=np.int32)
        distances = np.zeros(count)
        normals = np.zeros(3 * count)
        mujoco.mj_multiRay(
            mj, data, begin, flat, _SURROUNDINGS, 1, self._root, geoms, distances, normals, count, far
        )
        facing = np.abs(np.einsum("ij,ij->i", directions, normals.reshape(-1, 3)))
        heard = (geoms >= 0) & (~self._planes[geoms] | (facing > _GRAZING))
        distances[~heard] = math.inf
        nearest = int(distances.argmin())
        return float(distances[nearest]), nearest


def _cone(angle: float, rays: int) -> Array:
    """Return unit vectors that fill a cone about x evenly, as the seeds of a sunflower; shape (rays, 3)."""
    index = np.arange(rays)
    along = 1.0 - (1.0 - math.cos(angle / 2)) * index / (rays - 1)
    across = np.sqrt(1.0 - along * along)
    turn = index * math.pi * (3.0 - math.sqrt(5.0))
    return np.column_stack([along, across * np.cos(turn), across * np.sin(turn)])


def _turned_to(direction: Array) -> Array:
    """Return a rotation that turns x to a direction."""
    x, y, z = direction.tolist()
    across = math.hypot(x, y)
    left_x, left_y = -y / across, x / across
    return np.array(((x, left_x, -z * left_y), (y, left_y, z * left_x), (z, 0.0, across)))


_WARMTH: Final = 1.5
"""Kelvin by which a current of 1 A, permanently, warms the battery, times the current again."""
_TIME_CONSTANT: Final = 1800.0
"""Seconds in which it reaches 63 % of that."""


class BatteryModel:
    """Discharge as the motors work; `draw` is for the thread of the physics only.

    A motor takes its mechanical power plus the loss in its winding. With no-load speed w and stall torque T,
    at the voltage for which these hold, the loss is w/T times the square of the torque. Power that the load
    gives back is lost.
    """

    def __init__(self, robot: DeviceIndex, body: Body, facts: Battery) -> None:
        self._motors = robot.own_motors
        self._dofs = robot.dofs[robot.leading]
        motors = [body.joints[joint].motor for joint in robot.leading]
        self._losses = np.array([m.no_load_speed / m.stall_torque if m else 0.0 for m in motors])
        self._facts = facts
        self._energy = facts.energy
        self._temperature = AMBIENT
        self.reading = BatteryReading(1.0, 0.0, AMBIENT, plugged=False)
        """The newest reading."""

    def draw(self, seconds: float, torques: Array, velocities: Array) -> None:
        """Advance by some seconds with torques of the motors and velocities of the joints."""
        torque = torques[self._motors]
        power = torque * velocities[self._dofs] + self._losses * torque * torque
        watts = self._facts.electronics + float(np.maximum(power, 0.0).sum())
        current = watts / self._facts.voltage
        self._energy = max(self._energy - watts * seconds, 0.0)
        warmer = AMBIENT + _WARMTH * current * current - self._temperature
        self._temperature += warmer * seconds / _TIME_CONSTANT
        charge = self._energy / self._facts.energy
        self.reading = BatteryReading(charge, -current, self._temperature, plugged=False)


_log = logging.getLogger(__name__)

FALLING_TILT: Final = math.radians(35)
"""Tilt of the torso beyond which a fall cannot be stopped."""
FALLING_RATE: Final = 0.8
"""Rate in rad/s at which the tilt grows in a fall, but not in a motion that bends or lies down."""
LIMP_WITHIN: Final = 0.1
"""Seconds in which the motors let go."""
_UPRIGHT: Final = math.radians(15)
"""Greatest tilt at which the robot stands."""
_STANDING_TIME: Final = 0.5
"""Seconds on its feet after which falls are watched for, and off its feet after which they are not."""


class FallManager:
    """Watch tilt and feet at each tick, and go limp once per fall; in the thread of the physics."""

    def __init__(self, rules: FallRules, let_go: Callable[[float], None]) -> None:
        self._rules = rules
        self._let_go = let_go
        self._tilt = 0.0
        self._stood = 0.0
        self._off_feet = 0.0
        self.watching = False
        """True while a fall would be noticed."""
        self.falls = 0
        """Falls noticed so far."""

    def check(self, time: float, seconds: float, tilt: float, load: float) -> None:
        """Check the torso's tilt in rad and the load on the soles in N, `seconds` after the last check."""
        rate, self._tilt = (tilt - self._tilt) / seconds, tilt
        on_feet = load >= self._rules.standing_load
        self._off_feet = 0.0 if load >= self._rules.lying_load else self._off_feet + seconds
        self._stood = self._stood + seconds if on_feet and tilt < _UPRIGHT else 0.0
        if self._stood >= _STANDING_TIME:
            self.watching = True
        elif self._off_feet >= _STANDING_TIME:
            self.watching = False
        if self.watching and tilt > FALLING_TILT and rate > FALLING_RATE:
            self.watching = False
            self.falls += 1
            _log.warning("the robot falls at %.2f s: its motors let go", time)
            self._let_go(LIMP_WITHIN)


_LONGEST_NAME: Final = 64  # characters of a client's text that are quoted
_SWITCHES_AT: Final = 1.0
"""Force in N that presses a touch sensor."""


class Touch:
    """Report which of some sensors are pressed at a time. Thread-safe."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names
        self._lock = threading.Lock()
        # The begin and the end of the newest press of each sensor; replaced as a whole.
        self._presses: Mapping[str, tuple[float, float]] = {}

    def press(self, sensor: str, begin: float, seconds: float) -> None:
        """Press a sensor for some seconds, no less than before. Raises InvalidCommand for an unknown one."""
        if sensor not in self._names:
            name, names = sensor[:_LONGEST_NAME], ", ".join(self._names)
            raise InvalidCommand("name", f"there is no touch sensor {name!r}; there are {names}")
        end = begin + seconds
        with self._lock:
            first, last = self._presses.get(sensor, (begin, end))
            press = (first, max(last, end)) if last >= begin else (begin, end)
            self._presses = {**self._presses, sensor: press}

    def touched(self, time: float, felt: Mapping[str, float]) -> frozenset[str]:
        """Return the pressed sensors, by the forces in N on those that feel, and by calls of `press`."""
        names = {sensor for sensor, (begin, end) in self._presses.items() if begin <= time < end}
        names.update(name for name, force in felt.items() if force >= _SWITCHES_AT)
        return frozenset(names)


_NO_BATTERY: Final = BatteryReading(math.nan, 0.0, AMBIENT, plugged=True)
_NEAR: Final = 0.8
"""Distance in m up to which the sonar is precise."""
_FALLS_EVERY: Final = 2
"""Control ticks between two checks of the fall manager: 50 Hz, the cycle of NAOqi's motion."""


class SimulatedSenses:
    """Simulate the senses of a body, of those that it has.

    Implements `capabilities.Senses`. `noise` has the imperfections of the senses, with numbers
    from `random`: the same seed gives the same numbers at the same ticks.
    """

    def __init__(
        self,
        model: Model,
        simulator: Simulator,
        noise: SenseNoise | None,
        random: np.random.Generator,
        failing: FailingSenses,
    ) -> None:
        self._failing = failing
        self._data = simulator.data
        self._simulator = simulator
        self._noise = noise
        self._random = random
        self.record: Final = SensorRecord(model.mj, model.body, self._data, noise, random, failing=failing)
        """The readings of the last ticks, which a controller needs at every tick."""
        body = model.body
        self.touch_names: Final = body.touch_sensors
        self._battery = BatteryModel(model.robot, body, body.battery) if body.battery else None
        self._sonar = None
        if body.sonar:
            root = model.share.prefix + body.root.name
            self._sonar = SonarModel(model.whole, root, body.sonar, model.links_of_others)
        self.sonar_range: Final = (body.sonar.nearest, body.sonar.farthest) if body.sonar else None
        self.sonar_cone: Final = body.sonar.cone if body.sonar else 0.0
        self._touch = Touch(self.touch_names)
        self.falls: Final = FallManager(body.falls, self._go_limp) if body.falls else None
        """The detector of falls; None for a robot that cannot fall."""
        self._motors = model.robot.own_motors
        self._sonar_every = round(PERIOD / simulator.tick_period)
        self._ticks = 0
        self._everywhere = simulator.physics.data.qpos
        self._ping: tuple[Array, list[float]] = (self._everywhere.copy(), [0.0, 0.0])
        self._echo: tuple[Array, SonarReading] | None = None
        self._cached: tuple[Sample, SenseReading] | None = None

    def read(self) -> SenseReading:
        """Return the newest snapshot."""
        return self._failing.others(self._read())

    def _read(self) -> SenseReading:
        sample = self.record.newest
        touched = self._touch.touched(sample.time, self.record.felt(sample))
        cached = self._cached
        if cached is not None and cached[0] is sample:
            reading = cached[1]
            return reading if reading.touched == touched else replace(reading, touched=touched)
        left, right = self.record.feet(sample)
        reading = SenseReading(
            time=sample.time,
            inertial=sample.inertial,
            left_foot=left,
            right_foot=right,
            sonar=self._listen(),
            touched=touched,
            battery=self._battery.reading if self._battery else _NO_BATTERY,
        )
        self._cached = (sample, reading)
        return reading

    def inertial(self) -> InertialReading:
        """Return the newest reading of the inertial unit."""
        return self.record.newest.inertial

    def press(self, sensor: str, seconds: float) -> None:
        """Press a touch sensor for some seconds from now on. Raises InvalidCommand when there is no such."""
        self._touch.press(sensor, self._simulator.newest().time, seconds)

    def sample(self, time: float) -> None:
        """Record the measurements at the end of a control tick; for the thread of the physics only."""
        self.record.sample(time)
        self._ticks += 1
        period = self._simulator.tick_period
        if self.falls is not None and self._ticks % _FALLS_EVERY == 0:
            tilt = self.record.newest.inertial.tilt
            self.falls.check(time, period * _FALLS_EVERY, tilt, self.record.weight())
        if self._ticks % self._sonar_every == 0:
            if self._battery is not None:
                data = self._data
                torques = self._simulator.motors.torques(data.actuator_force)
                self._battery.draw(period * self._sonar_every, torques, data.qvel)
            errors = self._random.standard_normal(2).tolist() if self._noise else [0.0, 0.0]
            self._ping = (self._everywhere.copy(), errors)

    def _go_limp(self, seconds: float) -> None:
        self._simulator.motors.stiffen(self._motors, np.zeros(len(self._motors)), seconds)

    def _listen(self) -> SonarReading:
        """Return the newest measurement of the sonar: computed once, on request."""
        if self._sonar is None:
            return SonarReading()
        qpos, errors = self._ping
        echo = self._echo
        if echo is None or echo[0] is not qpos:
            heard = self._sonar.measure(qpos)
            reading = SonarReading(self._blur(heard.left, errors[0]), self._blur(heard.right, errors[1]))
            self._echo = echo = (qpos, reading)
        return echo[1]

    def _blur(self, distance: float, error: float) -> float:
        if self._noise is None or self.sonar_range is None or not math.isfinite(distance):
            return distance
        noise = self._noise.sonar_near if distance <= _NEAR else self._noise.sonar_far
        nearest, farthest = self.sonar_range
        return min(max(distance + noise * error, nearest), farthest)
