"""A robot put on its feet: the state in which a simulation begins."""

from __future__ import annotations

import copy
import logging
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Final

import mujoco
import numpy as np

from naoserver.bodies.footsteps import Footsteps
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim._body import BASE, MOUNT, SIDES, sole
from naoserver_sim._footsteps.limbs import limbs_of
from naoserver_sim._footsteps.posture import walking_stance
from naoserver_sim._surroundings import about_z
from naoserver_sim.model import Model, build_model
from naoserver_sim.world import World

_log = logging.getLogger(__name__)

_SETTLING_TIME: Final = 1.0  # s
_NEAR_STANCE: Final = 0.1
"""Largest angle in rad between a posture and the stance of the walk, in which it begins instead."""
_GAP: Final = 0.0002
"""Height in m from which the robot is lowered to the floor."""
_CLEARANCE: Final = 0.05
"""Least height in m above the floor of what a mounted robot moves, at the start."""
_HANGING: Final = 0.2
"""Height in m above the floor in which a mounted robot with feet has its soles, at the start."""
_FARTHEST_FLOOR: Final = 10.0
"""Largest distance in m of the floor from a robot whose root is at the origin."""


def standing(model: Model, posture: Mapping[str, float]) -> mujoco.MjData:
    """Return the state, at time 0, in which the robot stands still on its soles in a posture.

    It and everything else are at their starting places.
    """
    mj = model.mj
    data = mujoco.MjData(mj)
    angles = model.body.complete(posture)
    data.qpos[model.robot.qpos] = [angles[joint.name] for joint in model.robot.joints]
    for ball in model.world.carried_balls:
        data.qpos[model.balls[ball.name].qpos] = ball.start
    mujoco.mj_forward(mj, data)
    balances = False
    walk = model.body.walk
    if isinstance(walk, Footsteps):
        # In its stance it does not settle without its walk, so it begins exactly where that wants it.
        places = model.robot.qpos
        stance = walking_stance(mj, limbs_of(mj, model.body), walk, data.qpos[places])
        balances = bool(np.abs(stance - data.qpos[places]).max() < _NEAR_STANCE)
        if balances:
            data.qpos[places] = stance
            mujoco.mj_forward(mj, data)
    _put_on_floor(model, data)
    for device in (model.robot, *model.balls.values()):
        data.ctrl[device.own_motors] = data.qpos[device.qpos[device.leading]]
    if not balances:
        mujoco.set_mju_user_warning(_log.debug)  # by default, it writes a file into the current directory
        mujoco.mj_step(mj, data, nstep=round(_SETTLING_TIME / mj.opt.timestep))
        _require_still_sound(model, data)
    data.time = 0.0
    mujoco.mj_forward(mj, data)
    return data


def _require_still_sound(model: Model, data: mujoco.MjData) -> None:
    """Raise RobotError when the robot flew apart while it settled."""
    kinds = mujoco.mjtWarning
    for kind in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC):
        if data.warning[kind].number:
            dof = min(int(data.warning[kind].lastinfo), model.mj.nv - 1)
            joint = model.mj.joint(int(model.mj.dof_jntid[dof])).name
            at = "its root" if joint == BASE else f"joint {joint!r}"
            raise RobotError(
                f"body {model.body.name} cannot be simulated: at the start it flies apart, first at {at}."
                " Links may be too light for their servos: give these softer gains or more `inertia`, by"
                " [servo.NAME]; or shapes push each other apart: name them in `overlapping`"
            )


def build_standing(
    world: World, posture: str | None, *, skin: bool, body: Body
) -> tuple[Model, mujoco.MjData]:
    """Return a model, and the state in which its robot stands in one of the body's postures, or at rest.

    The caller may change both. Programs that simulate one robot after the other, as tests do, wait only once
    for the compiler and for the robot to settle.
    """
    model, data = _first_standing(world, posture, skin, body)
    mj = copy.copy(model.mj)
    own = replace(model, mj=mj, whole=mj)
    own_data = mujoco.MjData(own.mj)
    mujoco.mj_copyData(own_data, own.mj, data)
    return own, own_data


@lru_cache(maxsize=16)
def _first_standing(world: World, posture: str | None, skin: bool, body: Body) -> tuple[Model, mujoco.MjData]:
    if posture is not None and posture not in body.postures:
        raise RobotError(f"there is no posture {posture!r}; there are {', '.join(body.postures)}")
    model = build_model(world, skin=skin, body=body)
    return model, standing(model, body.resting_angles if posture is None else body.postures[posture].angles)


def _put_on_floor(model: Model, data: mujoco.MjData) -> None:
    """Move the base so that the robot stands at its starting place.

    The soles are flat on the floor with that place between them; a robot without soles is upright, and its
    root is above that place.
    """
    mj, body, base = model.mj, model.body, model.base.qpos
    level = np.array((1.0, 0.0, 0.0, 0.0))
    if body.soles:
        mujoco.mju_mat2Quat(level, data.geom(sole("left")).xmat.reshape(3, 3).T.flatten())
    start = model.start
    mujoco.mju_mulQuat(data.qpos[base + 3 : base + 7], np.array(about_z(start.heading)), level)
    mujoco.mj_forward(mj, data)
    data.qpos[base + 2] -= _height(model, data) - _GAP
    if body.soles:
        left, right = (data.body(foot.link).xpos[:2] for foot in body.soles)
        data.qpos[base : base + 2] = data.body(body.root.name).xpos[:2] - (left + right) / 2 + start.position
    else:
        data.qpos[base : base + 2] = start.position
    if body.mounted:
        relative = mj.equality(MOUNT).data[3:10]
        relative[:] = (0.0, 0.0, data.qpos[base + 2], 1.0, 0.0, 0.0, 0.0)
    mujoco.mj_forward(mj, data)


def _height(model: Model, data: mujoco.MjData) -> float:
    """Return the height in m of the lowest sole, or else of the lowest contact shape, above the floor."""
    mj = model.mj
    if model.body.soles:
        left, right = (data.geom(sole(side)) for side in SIDES)
        lowest = float(min(left.xpos[2], right.xpos[2]) - mj.geom(sole("left")).size[2])
        return lowest - _HANGING if model.body.mounted else lowest
    own = np.flatnonzero((mj.body_rootid[mj.geom_bodyid] == model.base.body) & (mj.geom_contype != 0))
    floor, ends = mj.geom("floor").id, np.zeros(6)
    heights = [mujoco.mj_geomDistance(mj, data, floor, geom, _FARTHEST_FLOOR, ends) for geom in own]
    if model.body.mounted:
        # What moves on a mount is clear of the floor; the mount itself is on the floor, or has no shape.
        moving = mj.body_weldid[mj.geom_bodyid[own]] != mj.body_weldid[model.base.body]
        heights = [*(np.array(heights) - _CLEARANCE * moving), data.qpos[model.base.qpos + 2]]
    return float(min(heights, default=0.0))
