"""The limbs of a described body in its model, and the stance in which it is ready to walk."""

from __future__ import annotations

import mujoco

from naoserver.body import Body
from naoserver.footsteps import Footsteps
from naoserver.parts import Axis
from naoserver_sim._footsteps.limbs import Array, Limbs, find_limbs
from naoserver_sim._footsteps.posture import stance


def limbs_of(mj: mujoco.MjModel, body: Body) -> Limbs:
    """Return the limbs of a body with two soles. Raises RobotError when its legs are no such legs."""
    left, right = (sole.link for sole in body.soles)
    hinges = (body.hinges.get(f"{side}Shoulder", {}) for side in ("Left", "Right"))
    shoulders = [axes[Axis.TILT].joint for axes in hinges if Axis.TILT in axes]
    return find_limbs(mj, body.root.name, (left, right), body.joint_names, shoulders)


def walking_stance(mj: mujoco.MjModel, body: Body, angles: Array) -> Array:
    """Return the angles in rad of all joints with which a body that walks by footsteps stands ready to walk.

    `angles` are those of a posture in which it stands; those of the legs are changed.
    """
    assert isinstance(body.walk, Footsteps)
    return stance(mj, limbs_of(mj, body), body.walk, angles)
