"""Where a compiled model has the limbs of a body on two legs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.footsteps import Footsteps
from naoserver.bodies.parts import Axis
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim._body import SIDES, middle_of

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Quaternion = tuple[float, float, float, float]
"""A turn: w, x, y, z."""

LEFT: Final = 0
RIGHT: Final = 1
LEG_JOINTS: Final = 6
"""Joints of a leg: as many as a foot has degrees of freedom."""


@dataclass(frozen=True)
class Arm:
    """An arm that can swing."""

    shoulder: int
    """The link that its first joint moves."""
    joints: tuple[int, ...]
    """All its joints, as places among the body's joints: first the one about the axis y, which swings it."""


@dataclass(frozen=True)
class Limbs:
    """Indices in MuJoCo's arrays, of joints in the order of the body."""

    base: int
    """The link with the free joint, in which the inertial unit is."""
    base_qpos: int
    base_dof: int
    pelvis: int
    """The link that both legs begin at."""
    feet: tuple[int, int]
    """Links, left and right."""
    middles: tuple[int, int]
    """Sites in the middles of the soles, left and right."""
    qpos: Indices
    dofs: Indices
    motors: Indices
    """Beyond the last motor for a joint without a separate one."""
    legs: Indices
    """The twelve joints of the legs, as places among the body's joints: the left leg from the hip down, then
    the right one."""
    arms: tuple[Arm, ...]
    """Left and right; none when no arm swings."""

    @cached_property
    def leg_dofs(self) -> Indices:
        """Degrees of freedom of the legs' joints."""
        return self.dofs[self.legs]

    @cached_property
    def leg_motors(self) -> Indices:
        """Motors of the legs' joints."""
        return self.motors[self.legs]

    def soles(self, data: mujoco.MjData) -> Array:
        """Return the middles of the soles in m, left and right, by where the links are in `data`."""
        places: Array = data.site_xpos.take(self.middles, axis=0)
        return places

    def commanded(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the setpoint of each joint, 0 of one without a separate motor."""
        found = setpoints.take(self.motors, mode="clip")
        found[self.motors == len(setpoints)] = 0.0
        return found


def limbs_of(mj: mujoco.MjModel, body: Body) -> Limbs:
    """Return the limbs of a body that walks by footsteps.

    Raises RobotError when a leg does not have six joints, all hinges with separate motors.
    """
    assert isinstance(body.walk, Footsteps)
    joints = body.joint_names
    places = {mj.joint(name).id: place for place, name in enumerate(joints)}
    left_foot, right_foot = (mj.body(sole.link).id for sole in body.soles)
    left, right = (list(_upwards(mj, foot)) for foot in (left_foot, right_foot))
    pelvis = next(link for link in left if link in right)
    legs: list[int] = []
    for sole, chain in zip(body.soles, (left, right), strict=True):
        # Parents come before their children.
        leg = np.flatnonzero(np.isin(mj.jnt_bodyid, chain[: chain.index(pelvis)])).tolist()
        if len(leg) != LEG_JOINTS or any(mj.jnt_type[leg] != mujoco.mjtJoint.mjJNT_HINGE):
            raise RobotError(f"the leg above {sole.link} has {len(leg)} joints: it needs {LEG_JOINTS} hinges")
        legs.extend(places[joint] for joint in leg)
    if without := [joints[place] for place in legs if joints[place] not in body.motors]:
        raise RobotError(
            f"walk: footsteps need a separate motor for each joint of a leg, not as {without[0]}"
        )
    left_middle, right_middle = (int(mj.site(middle_of(side)).id) for side in SIDES)
    root = mj.body(body.root.name).id
    free = mj.body_jntadr[root]
    shoulders = (body.hinges.get(f"{side}Shoulder", {}) for side in ("Left", "Right"))
    swings = [axes[Axis.TILT].joint for axes in shoulders if Axis.TILT in axes]
    return Limbs(
        base=root,
        base_qpos=int(mj.jnt_qposadr[free]),
        base_dof=int(mj.jnt_dofadr[free]),
        pelvis=pelvis,
        feet=(left_foot, right_foot),
        middles=(left_middle, right_middle),
        qpos=np.array([mj.joint(name).qposadr[0] for name in joints], dtype=np.intp),
        dofs=np.array([mj.joint(name).dofadr[0] for name in joints], dtype=np.intp),
        motors=np.array(
            [mj.actuator(name).id if name in body.motors else mj.nu for name in joints], dtype=np.intp
        ),
        legs=np.array(legs, dtype=np.intp),
        arms=tuple(
            _arm(mj, mj.joint(name).id, {mj.joint(at).id: joints.index(at) for at in body.motors})
            for name in swings
        ),
    )


def _arm(mj: mujoco.MjModel, swing: int, places: dict[int, int]) -> Arm:
    shoulder = int(mj.jnt_bodyid[swing])
    others = [
        place
        for joint, place in places.items()
        if joint != swing and shoulder in _upwards(mj, mj.jnt_bodyid[joint])
    ]
    return Arm(shoulder, (places[swing], *others))


def _upwards(mj: mujoco.MjModel, link: int) -> Iterator[int]:
    """Yield a link and what it hangs on, up to the root."""
    while link:
        yield int(link)
        link = mj.body_parentid[link]


def quaternion(heading: float, roll: float = 0.0, pitch: float = 0.0) -> Quaternion:
    """Return the turn about x by roll, then y by pitch, then z by heading as a quaternion w, x, y, z."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(heading / 2), math.sin(heading / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def inclination(turned: Array) -> tuple[float, float]:
    """Return roll and pitch in rad of axes as columns."""
    return math.atan2(turned[2, 1], turned[2, 2]), -math.asin(max(-1.0, min(1.0, turned[2, 0])))
