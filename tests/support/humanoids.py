"""Humanoids whose joints hold angles, of known bodies, on an empty floor in virtual time."""

from __future__ import annotations

import copy
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Final

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import InertialReading, WalkVelocity
from naoserver.bodies.footsteps import Footsteps
from naoserver.bodies.parts import Axis, Play
from naoserver_sim._footsteps.estimator import BodySensors
from naoserver_sim._footsteps.limbs import Limbs, limbs_of
from naoserver_sim._footsteps.posture import walking_stance
from naoserver_sim._footsteps.walker import FootstepWalker
from naoserver_sim._motors import Gears, SetpointController
from naoserver_sim._simulator import Physics, Simulator
from naoserver_sim.model import build_model
from naoserver_sim.world import load_world
from zenoh_ice import VirtualClock

__all__ = ["BODIES", "Humanoid", "Noise"]

Array = NDArray[np.float64]
BODIES: Final = {"booster_t1": find_body("T1"), "unitree_g1": find_body("G1")}
"""The bodies by their folders."""


@cache
def model_of(body: str, friction: float = 1.0) -> mujoco.MjModel:
    """Compile a body on an empty floor."""
    mj = build_model(load_world("empty"), skin=False, body=BODIES[body]).mj
    mj.geom_friction[:, 0] = friction
    return mj


@dataclass(frozen=True)
class Noise:
    """Imperfections of sensors, as standard deviations, and of gears."""

    turning: float = 0.005
    """Of the gyroscope in rad/s."""
    turning_offset: float = 0.005
    tilt: float = 0.003
    """Of roll and pitch in rad."""
    tilt_offset: float = 0.01
    speed: float = 0.05
    """Of the speeds of the joints in rad/s."""
    delay: int = 1
    """Ticks by which the inertial unit is late."""
    gears: Play = field(default_factory=lambda: Play(delay=1, least_backlash=0.0017, most_backlash=0.005))


class _NoisySensors(BodySensors):
    """Sensors whose speeds are noisy, too."""

    def __init__(
        self,
        simulator: Simulator,
        limbs: Limbs,
        inertial: Callable[[], InertialReading],
        noise: Noise,
        random: np.random.Generator,
    ) -> None:
        self._deviation = noise.speed
        self._random = random
        super().__init__(simulator, limbs, inertial, noise=True, delay=noise.delay)

    def tick(self) -> None:
        super().tick()
        self.speeds = self.speeds + self._random.normal(0.0, self._deviation, len(self.speeds))


class Humanoid:
    """A body that stands, and has a walker, in virtual time; with `noise` as imperfect as it says."""

    def __init__(
        self,
        body: str,
        *,
        seed: int = 0,
        noise: Noise | None = None,
        friction: float = 1.0,
        **parameters: Any,
    ) -> None:
        described = BODIES[body]
        assert isinstance(described.walk, Footsteps)
        self.body: Final = described
        self.mj = copy.copy(model_of(body, friction))
        self.shoulders: Final = [
            described.hinges[f"{side}Shoulder"][Axis.TILT].joint for side in ("Left", "Right")
        ]
        """The joints that swing the arms."""
        self.clock = VirtualClock()
        self._random = np.random.default_rng(seed)
        self._noise = noise
        names = described.joint_names
        self.limbs = limbs_of(self.mj, described)
        self.footsteps = msgspec.structs.replace(described.walk, **parameters)
        self.data = mujoco.MjData(self.mj)
        angles = np.array([described.resting_angles[name] for name in names])
        self.data.qpos[self.limbs.qpos] = walking_stance(self.mj, self.limbs, self.footsteps, angles)
        self._lower()
        self.data.ctrl[self.limbs.motors] = self.data.qpos[self.limbs.qpos]
        lower, upper = self.mj.actuator_ctrlrange.T.copy()
        self.setpoints = SetpointController(self.data.ctrl.copy(), lower, upper, np.full(self.mj.nu, 6.0))
        gears = None
        if noise is not None:
            gears = Gears(noise.gears, self.data.ctrl, self.mj.nu, self._random.spawn(1)[0])
            self._offsets = self._random.normal(0.0, [noise.turning_offset] * 3 + [noise.tilt_offset] * 2)
        self.simulator = Simulator(Physics(self.mj, self.data), self.setpoints, gears)
        self.clock.call_every(self.simulator.tick_period, lambda: self.simulator.physics.advance(1))
        self._attitude = self.data.qpos[3:7].copy()
        self._readings: deque[InertialReading] = deque(maxlen=1 + (noise.delay if noise else 0))
        self._look(0.0)
        self.walker = FootstepWalker(
            self.footsteps,
            self.limbs,
            self.simulator,
            BodySensors(self.simulator, self.limbs, self.inertial)
            if noise is None
            else _NoisySensors(self.simulator, self.limbs, self.inertial, noise, self._random.spawn(1)[0]),
            latency=0.0 if noise is None else noise.gears.delay * self.simulator.tick_period,
        )
        self.leg_names: Final = [names[joint] for joint in self.limbs.legs]
        """The joints of the legs."""
        self._force = np.zeros(3)
        self._pushed = 0.0
        self.tilt = 0.0
        """Largest tilt of the trunk in rad so far."""
        self.simulator.parts.extend((self.walker.tick, self._push))
        self.simulator.watchers.append(self._look)

    def go(self, seconds: float) -> None:
        """Let time pass."""
        self.clock.advance(seconds)

    def walk(self, velocity: WalkVelocity, seconds: float = 0.0) -> None:
        """Command a velocity and let time pass."""
        self.walker.command(velocity)
        self.go(seconds)

    def push(self, x: float, y: float, seconds: float = 0.1) -> None:
        """Push the trunk with a force in N in the world's frame, for some seconds."""
        self._force[:2] = x, y
        self._pushed = seconds

    def hang(self, height: float) -> None:
        """Lift the robot by a height in m, where nothing pulls it down again."""

        def lift() -> None:
            self.data.qpos[2] += height
            self.mj.opt.gravity[2] = 0.0

        self.simulator.order(lift)

    def move(self, targets: dict[str, float], speed: float) -> None:
        """Move some joints to angles in rad at a speed in rad/s."""
        motors = np.array([self.mj.actuator(name).id for name in targets], dtype=np.intp)
        values = np.array(list(targets.values()))
        self.simulator.order(lambda: self.setpoints.move(motors, values, np.full(len(motors), speed)))

    def place(self) -> tuple[float, float, float]:
        """Return the true position of the robot on the floor, and its heading."""
        w, x, y, z = self.data.qpos[3:7].tolist()
        heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return float(self.data.qpos[0]), float(self.data.qpos[1]), heading

    @property
    def fallen(self) -> bool:
        """Whether it lies."""
        return self.tilt > math.radians(60)

    def angles(self, *names: str) -> list[float]:
        """Return the angles of some joints in rad."""
        return [float(self.data.joint(name).qpos[0]) for name in names]

    def commands(self, *names: str) -> list[float]:
        """Return the setpoints of some joints in rad."""
        found = self.setpoints.setpoints
        return [float(found[self.mj.actuator(name).id]) for name in names]

    def _lower(self) -> None:
        """Put it on its soles."""
        mujoco.mj_forward(self.mj, self.data)
        sole = np.array(self.footsteps.sole_middle)
        heights = [
            (self.data.xpos[foot] + self.data.xmat[foot].reshape(3, 3) @ sole)[2] for foot in self.limbs.feet
        ]
        self.data.qpos[2] -= min(heights)
        mujoco.mj_forward(self.mj, self.data)

    def inertial(self) -> InertialReading:
        """Return the reading of the inertial unit, with its errors."""
        return self._readings[0]

    def _look(self, _: float) -> None:
        w, x, y, z = self.data.qpos[3:7].tolist()
        roll = math.atan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - x * z))))
        turning = self._mean_turning()
        reading = InertialReading((0.0, 0.0, 9.81), tuple(turning.tolist()), roll, pitch)
        if hasattr(self, "tilt"):
            self.tilt = max(self.tilt, reading.tilt)
        noise = self._noise
        if noise is not None:
            turning += self._random.normal(0.0, noise.turning, 3) + self._offsets[:3]
            roll += self._random.normal(0.0, noise.tilt) + self._offsets[3]
            pitch += self._random.normal(0.0, noise.tilt) + self._offsets[4]
            reading = replace(reading, angular_velocity=tuple(turning.tolist()), roll=roll, pitch=pitch)
        self._readings.append(reading)

    def _mean_turning(self) -> Array:
        """Return the turning rate of the trunk in rad/s, as a gyroscope measures it: over a whole tick."""
        now, turned = self.data.qpos[3:7].copy(), np.zeros(3)
        mujoco.mju_subQuat(turned, now, self._attitude)
        self._attitude = now
        return turned / self.simulator.tick_period

    def _push(self, seconds: float) -> None:
        applied = self.data.xfrc_applied[self.limbs.base]
        applied[:3] = self._force if self._pushed > 1e-9 else 0.0
        self._pushed -= seconds
