"""The sonar: rays in two cones, cast against what surrounds the robot.

Sound that meets the floor at a flat angle is reflected away from the robot, so it hears no echo of it; the
robot's own body is not seen either.
"""

from __future__ import annotations

import math
import threading
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.body import H25
from naoserver.capabilities import SonarReading
from naoserver_sim.body import TORSO

Array = NDArray[np.float64]

RANGE: Final = (0.25, 2.55)
"""Smallest and largest reported distance in m: those of NAOqi's driver for ROS and of the documentation
up to V4. That of V5 and V6 promises no more than 0.2 m to 0.8 m, and calls larger distances an estimation."""
PERIOD: Final = 0.1
"""Seconds between two measurements."""
_WIDE_RAYS: Final = 256
"""Rays of a cone, 3.3 degrees apart. Small things are not overlooked: there is an extra ray to each thing."""
_NARROW_RAYS: Final = 64
_NARROW: Final = math.radians(6)
"""Full angle of the cone in which the nearest echo is measured again."""
_SURROUNDINGS: Final = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)
"""The groups of geoms that give an echo: not those of the robot."""
_GRAZING: Final = math.cos(math.radians(45))
"""Cosine of the angle to its normal from which on a plane reflects the sound away."""


class Sonar:
    """Measure the nearest echo of the left and the right transducer. Safe to use from any thread."""

    def __init__(self, mj: mujoco.MjModel) -> None:
        facts = H25.facts["sonar"]
        self.cone: Final = math.radians(facts["cone_deg"])
        """Full angle of the cones in rad."""
        self._mj = mj
        self._data = mujoco.MjData(mj)
        self._lock = threading.Lock()
        self._torso = mj.body(TORSO).id
        self._things = np.flatnonzero((mj.geom_group == 0) & (mj.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
        self._planes = mj.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
        self._wide = _cone(self.cone, _WIDE_RAYS)
        self._narrow = _cone(_NARROW, _NARROW_RAYS)
        self._transducers = [
            (np.array(facts[side]["position"]), _rotation(facts[side]["rpy"])) for side in ("left", "right")
        ]

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
        axes = data.xmat[self._torso].reshape(3, 3)
        begin = data.xpos[self._torso] + axes @ place
        axes = axes @ turn
        rays = np.vstack([self._wide, self._within_cone((data.geom_xpos[self._things] - begin) @ axes)])
        distance, ray = self._cast(begin, rays @ axes.T)
        if not math.isfinite(distance):
            return math.inf
        closer = np.vstack([rays[ray], self._within_cone(self._narrow @ _turned_to(rays[ray]).T)])
        distance = min(distance, self._cast(begin, closer @ axes.T)[0])
        return max(distance, RANGE[0])

    def _within_cone(self, rays: Array) -> Array:
        """Return those of some rays in the transducer's frame that are within its cone, as unit vectors."""
        directions = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        within: Array = directions[directions[:, 0] >= math.cos(self.cone / 2)]
        return within

    def _cast(self, begin: Array, directions: Array) -> tuple[float, int]:
        """Return the distance to the nearest echo, infinite when there is none, and along which direction."""
        count = len(directions)
        geoms, distances, normals = np.zeros(count, dtype=np.int32), np.zeros(count), np.zeros(3 * count)
        mujoco.mj_multiRay(
            self._mj,
            self._data,
            begin,
            np.ascontiguousarray(directions).ravel(),
            _SURROUNDINGS,
            1,
            self._torso,
            geoms,
            distances,
            normals,
            count,
            RANGE[1],
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
    left = np.cross([0.0, 0.0, 1.0], direction)
    left /= np.linalg.norm(left)
    return np.column_stack([direction, left, np.cross(direction, left)])


def _rotation(rpy: tuple[float, float, float]) -> Array:
    """Return the rotation by roll, pitch and yaw about fixed axes, as in URDF."""
    quaternion, matrix = np.zeros(4), np.zeros(9)
    mujoco.mju_euler2Quat(quaternion, np.array(rpy), "XYZ")
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
