"""A simulated body without a server, stepped by the test, and its motion without MuJoCo's sensors."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.nao import H25
from naoserver_sim._body import add_sensors
from naoserver_sim._senses.record import SenseNoise, SensorRecord
from naoserver_sim.model import build_model
from naoserver_sim.standing import standing

Array = NDArray[np.float64]

GRAVITY = np.array([0.0, 0.0, -9.81])


class Lab:
    """A robot on the floor, standing in a posture, with the record of its sensors."""

    def __init__(
        self, posture: Mapping[str, float] | None = None, noise: SenseNoise | None = None, seed: int = 0
    ) -> None:
        self.model = build_model(skin=False)
        self.mj = self.model.mj
        self.data = standing(self.model, posture or H25.postures["StandInit"].angles)
        self.record = SensorRecord(self.mj, H25, self.data, noise, np.random.default_rng(seed))
        base = self.mj.joint("base")
        self.base: int = int(base.qposadr[0])
        self.dof: int = int(base.dofadr[0])

    def step(self, steps: int = 1) -> None:
        """Step the physics, and read the sensors."""
        mujoco.mj_step(self.mj, self.data, nstep=steps)
        self.record.sample(self.data.time)

    def lift(self, height: float) -> None:
        """Lift the robot into the air."""
        self.data.qpos[self.base + 2] += height
        mujoco.mj_forward(self.mj, self.data)

    def pose(self) -> tuple[Array, Array]:
        """Return the position of the torso in m, and its axes as columns."""
        pose = self.data.qpos[self.base : self.base + 7]
        return pose[:3].copy(), rotation(pose[3:7])

    def spin(self, rate: Array) -> None:
        """Turn the torso at a rate in rad/s about its axes."""
        self.data.qvel[self.dof + 3 : self.dof + 6] = rate

    def center_of_mass(self) -> Array:
        """Return the robot's center of mass in m: of the links that the facts name."""
        names = [link.name for link in H25.links]
        masses = np.array([self.mj.body(name).mass[0] for name in names])
        places = np.array([self.data.body(name).xipos for name in names])
        center: Array = masses @ places / masses.sum()
        return center


def rotation(quaternion: Array) -> Array:
    """Return the matrix of a unit quaternion w, x, y, z."""
    w, (x, y, z) = quaternion[0], quaternion[1:]
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix: Array = np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
    return matrix


def loose_parts(*blocks: tuple[Array, Array], foot_mass: float = 1.0) -> mujoco.MjSpec:
    """Return the torso and two feet of 1 kg on the floor without a body, and blocks that do not move.

    A block is its center and its half sizes in m. The ankles are 0.1 m to the left and right of the origin.
    """
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.0025
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1])
    height = H25.soles[0].height
    links = {}
    for name, place in (("torso", [0, 0, 1.0]), ("l_foot", [0, 0.1, height]), ("r_foot", [0, -0.1, height])):
        links[name] = spec.worldbody.add_body(name=name, pos=place)
    for side in "lr":
        foot = links[f"{side}_foot"]
        foot.add_freejoint()
        foot.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[0.075, 0.044, 0.012],
            pos=[0.0244, 0, 0.012 - height],
            mass=foot_mass,
        )
    for center, half_sizes in blocks:
        block = spec.worldbody.add_body(pos=center)  # its geom counts after those of the feet
        block.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half_sizes)
    add_sensors(spec, H25, links)
    return spec
