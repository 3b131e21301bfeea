"""Links that touch stop each other, except neighbors."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from naoserver.bodies.nao import H25
from naoserver.errors import RobotError
from naoserver_sim.model import build_model
from naoserver_sim.standing import standing

pytestmark = pytest.mark.sim

INTO_THE_BODY = {
    "forearm into the torso": {"LShoulderRoll": -0.3, "LElbowRoll": -1.5, "LElbowYaw": 0.0, "LShoulderPitch": 1.5},
    "forearms into each other": {
        "LShoulderPitch": 0.8, "LShoulderRoll": -0.3, "LElbowRoll": -1.2, "LElbowYaw": 0.0,
        "RShoulderPitch": 0.8, "RShoulderRoll": 0.3, "RElbowRoll": 1.2, "RElbowYaw": 0.0,
    },
    "hand into the head": {"LShoulderPitch": -1.4, "LShoulderRoll": -0.3, "LElbowRoll": -1.0, "LElbowYaw": 0.0},
    "knees into each other": {"LHipRoll": -0.37, "RHipRoll": 0.37},
}  # fmt: skip


@pytest.fixture(scope="module")
def model():
    return build_model(skin=False)


def commanded(model, targets):
    """Return the state after 2 s in which the motors pulled towards targets, weightless above the floor."""
    mj = copy.copy(model.mj)
    mj.opt.gravity[:] = 0
    data = standing(model, H25.postures["StandInit"].angles)
    data.qpos[model.base.qpos + 2] += 1.0
    for joint, motor in zip(model.robot.joints, model.robot.motors, strict=True):
        if joint.name in targets:
            data.ctrl[motor] = targets[joint.name]
    mujoco.mj_step(mj, data, nstep=800)
    return data


def deepest_among_links(model, data):
    """Return by how many m two links reach into each other at most; negative when none touch."""
    links = model.mj.geom_bodyid
    depths = [-c.dist for c in data.contact if links[c.geom1] and links[c.geom2]]
    return max(depths, default=-np.inf)


@pytest.mark.parametrize("targets", INTO_THE_BODY.values(), ids=INTO_THE_BODY)
def test_links_that_are_driven_into_each_other_stop(model, targets):
    data = commanded(model, targets)
    assert 0 <= deepest_among_links(model, data) < 0.003


def test_motor_of_a_stopped_link_pulls_with_no_more_than_its_torque(model):
    data = commanded(model, INTO_THE_BODY["forearm into the torso"])
    forces, limits = np.abs(data.actuator_force), model.mj.actuator_forcerange[:, 1]
    assert (forces <= limits * 1.0001).all()


@pytest.mark.parametrize("posture", ["Stand", "StandInit", "StandZero"])
def test_nothing_touches_in_a_posture(model, posture):
    data = standing(model, H25.postures[posture].angles)
    assert deepest_among_links(model, data) == -np.inf


def test_a_foot_without_the_shape_of_its_sole_is_refused():
    bare = replace(H25, shapes=tuple(shape for shape in H25.shapes if shape.name != "right_sole"))
    with pytest.raises(RobotError, match="body H25: below r_foot there is no shape called right_sole"):
        build_model(skin=False, body=bare)
