"""The sonar: rays in two cones, cast against what surrounds the robot.

Sound that meets the floor at a flat angle is thrown away from the robot, so that it hears no echo of it; the
robot's own body is not seen either.
"""

from __future__ import annotations

import math
import threading
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.body import Body
from naoserver.capabilities import SonarReading
from naoserver_sim.body import TORSO

Array = NDArray[np.float64]

RANGE: Final = (0.25, 2.55)
"""Nearest and farthest distance in m that is told: those of NAOqi's driver for ROS and of the documentation
up to V4. That of V5 and V6 promises no more than 0.2 m to 0.8 m, and calls what is beyond an estimation."""
PERIOD: Final = 0.1
"""Seconds between two measurements."""
_RAYS: Final = 256
_SURROUNDINGS: Final = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)
"""The groups of geoms that give an echo: not those of the robot."""
_GRAZING: Final = math.cos(math.radians(45))
"""Cosine of the angle against its normal from which on a plane throws the sound away."""


class Sonar:
    """Measure what is nearest in front of the left and the right transducer. Safe to use from any thread."""

    def __init__(self, mj: mujoco.MjModel, body: Body) -> None:
        facts = body.facts["sonar"]
        self.cone: Final = math.radians(facts["cone_deg"])
        """Full angle of the cones in rad."""
        self._mj = mj
        self._data = mujoco.MjData(mj)
        self._lock = threading.Lock()
        self._torso = mj.body(TORSO).id
        self._planes = mj.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
        self._transducers = [
            (np.array(facts[side]["position"]), _directions(self.cone) @ _rotation(facts[side]["rpy"]).T)
            for side in ("left", "right")
        ]
        self._geoms = np.zeros(_RAYS, dtype=np.int32)
        self._distances = np.zeros(_RAYS)
        self._normals = np.zeros(3 * _RAYS)

    def measure(self, qpos: Array) -> SonarReading:
        """Return the distances in a state; infinite where nothing is in range."""
        with self._lock:
            self._data.qpos[:] = qpos
            mujoco.mj_kinematics(self._mj, self._data)
            left, right = (self._nearest(place, rays) for place, rays in self._transducers)
        return SonarReading(left, right)

    def _nearest(self, place: Array, rays: Array) -> float:
        data = self._data
        axes = data.xmat[self._torso].reshape(3, 3)
        begin = data.xpos[self._torso] + axes @ place
        directions = rays @ axes.T
        mujoco.mj_multiRay(
            self._mj,
            data,
            begin,
            directions.ravel(),
            _SURROUNDINGS,
            1,
            self._torso,
            self._geoms,
            self._distances,
            self._normals,
            _RAYS,
            RANGE[1],
        )
        heard = self._geoms >= 0
        facing = np.abs(np.einsum("ij,ij->i", directions, self._normals.reshape(-1, 3)))
        heard &= ~self._planes[self._geoms] | (facing > _GRAZING)
        nearest = float(self._distances[heard].min(initial=math.inf))
        return max(nearest, RANGE[0]) if nearest <= RANGE[1] else math.inf


def _directions(cone: float) -> Array:
    """Return unit vectors that fill a cone about x evenly, as the seeds of a sunflower; shape (rays, 3)."""
    index = np.arange(_RAYS)
    along = 1.0 - (1.0 - math.cos(cone / 2)) * index / (_RAYS - 1)
    across = np.sqrt(1.0 - along * along)
    turn = index * math.pi * (3.0 - math.sqrt(5.0))
    return np.column_stack([along, across * np.cos(turn), across * np.sin(turn)])


def _rotation(rpy: tuple[float, float, float]) -> Array:
    """Return the rotation by roll, pitch and yaw about fixed axes, as in URDF."""
    quaternion, matrix = np.zeros(4), np.zeros(9)
    mujoco.mju_euler2Quat(quaternion, np.array(rpy), "XYZ")
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
