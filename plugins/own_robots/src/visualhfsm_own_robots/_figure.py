"""How the robot of a compiled model stands: where its parts are at rest, and what its joints carry."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GRAVITY: Final = 9.81
_SAFETY: Final = 2.0
"""Largest torque of a joint of which nobody says it, as a multiple of what gravity can ask of it."""
_OF_A_LEG: Final = 0.5
"""Share of a leg's length by which the weight of the robot is beside its joints when it crouches."""
_LEANS: Final = 0.1
"""Share of the height of the center of mass by which it may be ahead of an ankle."""
_ACCELERATION: Final = 10.0
"""Acceleration in rad/s2 that such a torque gives to what the joint carries, at least."""
_LEAST: Final = 0.2
"""Least such torque in N m, or force in N: bearings and grips need some."""
_ON_THE_FLOOR: Final = 0.05
"""Height above the floor, as a share of the robot's, up to which a part stands on it."""
_BENT: Final = 0.3
"""Share of a range that has no 0, from its end nearer to 0: knees bend that far."""
_TINY: Final = 1e-12
_ROUND: Final = 12
"""Points on the rim of what is round."""
_THIN: Final = 1e-4
"""Extent in m below which points span no volume that MuJoCo takes."""
HOME: Final = ("home", "stand", "standing", "rest", "init")
"""Names of keyframes in which a robot waits; others are not read."""
_TURNS: Final = np.linspace(0.0, math.tau, _ROUND, endpoint=False)
_RIM: Final[Array] = np.stack((np.cos(_TURNS), np.sin(_TURNS), np.zeros(_ROUND)), axis=1)
_BALL: Final[Array] = np.concatenate([np.roll(_RIM, turn, axis=1) for turn in range(3)])
_CORNERS: Final[Array] = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T


def touching(mj: mujoco.MjModel) -> tuple[list[int], bool]:
    """Return the geoms of bodies that touch things, and whether the model says so.

    In a model that gives no body such a geom, all touch.
    """
    kinds = mujoco.mjtGeom
    ground = (kinds.mjGEOM_PLANE, kinds.mjGEOM_HFIELD, kinds.mjGEOM_SDF)
    robot = (mj.geom_bodyid > 0) & (mj.body_mocapid[mj.body_rootid[mj.geom_bodyid]] < 0)
    own = np.flatnonzero(robot & ~np.isin(mj.geom_type, [int(kind) for kind in ground])).tolist()
    paired = {*mj.pair_geom1.tolist(), *mj.pair_geom2.tolist()}
    solid = [geom for geom in own if mj.geom_contype[geom] or mj.geom_conaffinity[geom] or geom in paired]
    return (solid, True) if solid else (own, not own)


def hull_of(mj: mujoco.MjModel, geom: int) -> Array:
    """Return the corners of the convex hull of a geom's mesh in the frame of its body.

    It has none if it is no mesh that touches, or is flat.
    """
    mesh = int(mj.geom_dataid[geom])
    graph = int(mj.mesh_graphadr[mesh]) if mj.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH else -1
    if graph < 0:
        return np.zeros((0, 3))
    # The numbers of corners and faces, where the edges of each corner begin, and the corners.
    begin, count = graph + 2 + int(mj.mesh_graph[graph]), int(mj.mesh_graph[graph])
    corners = mj.mesh_vert[mj.mesh_vertadr[mesh] + mj.mesh_graph[begin : begin + count]].astype(np.float64)
    if np.linalg.svd(corners - corners.mean(axis=0), compute_uv=False)[-1] < _THIN:
        return np.zeros((0, 3))
    placed: Array = corners @ matrix_of(mj.geom_quat[geom]).T + mj.geom_pos[geom]
    return placed


def matrix_of(quaternion: Array) -> Array:
    """Return the rotation of a quaternion, w first, as a matrix."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


class Figure:
    """A robot at rest: in a keyframe of its model, or with its joints at 0, or within a range without it."""

    def __init__(self, mj: mujoco.MjModel) -> None:
        self.mj: Final = mj
        self.data: Final = mujoco.MjData(mj)
        self.key: Final = self._key()
        if self.key is not None:
            self.data.qpos[:] = mj.key_qpos[self.key]
        else:
            low, high = mj.jnt_range.T
            near, far = np.where(low > 0.0, (low, high), (high, low))
            bent = (mj.jnt_limited != 0) & ((low > 0.0) | (high < 0.0))
            self.data.qpos[mj.jnt_qposadr[bent]] = (near + _BENT * (far - near))[bent]
        mujoco.mj_kinematics(mj, self.data)
        mujoco.mj_comPos(mj, self.data)
        self.solid, self.says_what_touches = touching(mj)

    def _key(self) -> int | None:
        """Return the keyframe in which the robot waits; None without one by such a name."""
        names = [self.mj.key(key).name.lower() for key in range(self.mj.nkey)]
        return next((names.index(name) for name in HOME if name in names), None)

    @cached_property
    def _carried(self) -> list[int]:
        """How many bodies each body carries, with itself."""
        carried = [1] * self.mj.nbody
        for body in range(self.mj.nbody - 1, 0, -1):
            carried[self.mj.body_parentid[body]] += carried[body]
        return carried

    def moved(self, joint: int) -> range:
        """Return the bodies that a joint moves: MuJoCo numbers a body before those that it carries."""
        first = int(self.mj.jnt_bodyid[joint])
        return range(first, first + self._carried[first])

    @cached_property
    def hulls(self) -> dict[int, Array]:
        """Corners of the hull of each mesh that touches, in m in its body's frame; of other geoms none."""
        return {geom: hull_of(self.mj, geom) for geom in self.solid}

    @cached_property
    def surfaces(self) -> dict[int, Array]:
        """Points on the surface of each geom that touches, in m."""
        found = {}
        for geom in self.solid:
            body = int(self.mj.geom_bodyid[geom])
            turn, place, surface = self.data.geom_xmat[geom], self.data.geom_xpos[geom], self._surface(geom)
            if len(self.hulls[geom]):
                turn, place, surface = self.data.xmat[body], self.data.xpos[body], self.hulls[geom]
            found[geom] = surface @ turn.reshape(3, 3).T + place
        return found

    def _surface(self, geom: int) -> Array:
        """Return points on the surface of a geom in its frame in m."""
        kind = mujoco.mjtGeom(int(self.mj.geom_type[geom]))
        size: Array = self.mj.geom_size[geom]
        points: Array = _BALL * (size if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID else size[0])
        if kind in (mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_MESH):  # a flat one
            points = _CORNERS * self.mj.geom_aabb[geom, 3:] + self.mj.geom_aabb[geom, :3]
        elif kind in (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE):
            around = points if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else _RIM * size[0]
            points = np.concatenate([around + np.array((0.0, 0.0, end)) for end in (-size[1], size[1])])
        return points

    def points(self, *bodies: int) -> Array:
        """Return points in m on the surfaces of some bodies that touch things, shape (n, 3)."""
        own, wanted = self.mj.geom_bodyid, set(bodies)
        of = [each for geom, each in self.surfaces.items() if int(own[geom]) in wanted]
        return np.concatenate([np.zeros((0, 3)), *of])

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """The lowest and the highest corner of the box around the robot in m; its bottom is the floor."""
        touched = self.points(*range(1, self.mj.nbody))
        points = np.concatenate([touched, self.data.xpos[1:]])
        low, high = points.min(axis=0), points.max(axis=0)
        if len(touched):
            low[2] = touched[:, 2].min()
        return low, high

    @cached_property
    def near(self) -> float:
        """Distance in m from the floor up to which a part stands on it."""
        low, high = self.box
        return max(_ON_THE_FLOOR * float((high - low).max()), 1e-3)

    def stands(self, *bodies: int) -> bool:
        """Return whether one of some bodies is on the floor."""
        points = self.points(*bodies)
        return bool(len(points)) and float(points[:, 2].min()) < self.box[0][2] + self.near

    def load(self, joint: int) -> float:
        """Return the largest torque in N m, or force in N, by which gravity pulls what a joint carries."""
        bodies = self.moved(joint)
        masses = self.mj.body_mass[bodies]
        if self.slides(joint):
            return GRAVITY * float(masses.sum())
        arms = np.linalg.norm(self.data.xipos[bodies] - self.data.xanchor[joint], axis=1)
        return GRAVITY * float(masses @ arms)

    def standing(self, joint: int, *, mounted: bool) -> float:
        """Return the torque in N m, or force in N, that a joint may need for what stands on it."""
        weight, height = self._above(joint, mounted=mounted)
        if not weight or self.slides(joint):
            return weight
        points = self.points(*self.moved(joint))
        length = float(np.linalg.norm(points - self.data.xanchor[joint], axis=1).max())
        return weight * max(_OF_A_LEG * length, _LEANS * height)

    def torque(self, joint: int, *, mounted: bool) -> float:
        """Return a largest torque in N m, or force in N, that fits the mass that a joint carries."""
        quick = _ACCELERATION * float(self.inertias[0][self.mj.jnt_dofadr[joint]])
        wanted = max(_SAFETY * self.load(joint), self.standing(joint, mounted=mounted), quick, _LEAST)
        return float(f"{wanted:.2g}")

    def tips(self, joint: int, *, mounted: bool) -> float:
        """Return the torque in N m for each rad by which the robot falls about a joint that carries it."""
        weight, height = self._above(joint, mounted=mounted)
        return 0.0 if self.slides(joint) else weight * height

    def _above(self, joint: int, *, mounted: bool) -> tuple[float, float]:
        """Return the weight in N of what stands on a joint, and how high in m that is above it; or zeros."""
        bodies = self.moved(joint)
        if mounted or not self.stands(*bodies):
            return 0.0, 0.0
        masses = self.mj.body_mass.copy()
        masses[bodies] = 0.0
        total = float(masses.sum())
        center = float(masses @ self.data.xipos[:, 2]) / max(total, 1e-9)
        return GRAVITY * total, max(center - float(self.data.xanchor[joint, 2]), 0.0)

    def slides(self, joint: int) -> bool:
        """Return whether a joint slides; else it turns."""
        return bool(self.mj.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE)

    @cached_property
    def inertias(self) -> tuple[Array, Array]:
        """The inertia that each degree of freedom moves, with the others held and with the others free."""
        mj = self.mj
        mujoco.mj_makeM(mj, self.data)
        full = np.zeros((mj.nv, mj.nv))
        mujoco.mj_fullM(mj, self.data, full)
        held = np.maximum(np.diag(full), _TINY)
        try:
            free = 1.0 / np.maximum(np.diag(np.linalg.inv(full)), _TINY)
        except np.linalg.LinAlgError:  # links of masses that are too different
            free = held
        return held, np.minimum(free, held)
