"""The closed form of the legs' kinematics, compared with MuJoCo."""

import math
from functools import cache

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from naoserver_sim._walk.legs import FootPose, Legs, leg_motors
from naoserver_sim.model import build_model
from tests.support.examples import examples

pytestmark = pytest.mark.sim

SIDES = (("l_foot", 1.0), ("r_foot", -1.0))
SOLE = np.array([0.0, 0.0, -H25.soles[0].height])
RANGES = {joint.name: (joint.lower, joint.upper) for joint in H25.joints}


@cache
def model():
    return build_model(skin=False)


def soles(angles):
    """Return place and rotation of both soles in the torso's frame, as MuJoCo has them."""
    mj = model().mj
    data = mujoco.MjData(mj)
    for joint, angle in angles.items():
        data.joint(joint).qpos[0] = angle
    mujoco.mj_kinematics(mj, data)
    torso = data.body("torso")
    axes = torso.xmat.reshape(3, 3)
    found = []
    for foot, _ in SIDES:
        body = data.body(foot)
        rotation = axes.T @ body.xmat.reshape(3, 3)
        found.append((axes.T @ (body.xpos - torso.xpos) + rotation @ SOLE, rotation))
    return found


def rotation(pose):
    quaternion, matrix = np.zeros(4), np.zeros(9)
    mujoco.mju_euler2Quat(quaternion, np.array([pose.roll, pose.pitch, pose.yaw]), "XYZ")
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def solved(legs, left, right):
    angles = dict(zip(leg_motors(H25), legs.solve(left, right), strict=True))
    return angles | {"RHipYawPitch": angles["LHipYawPitch"]}


small = st.floats(-0.1, 0.1)


@st.composite
def stances(draw):
    """Both feet below the hips, turned against each other."""
    yaw = draw(st.floats(-0.25, 0.25))

    def foot(side):
        return FootPose(
            x=draw(st.floats(-0.06, 0.06)),
            y=side * 0.05 + draw(st.floats(-0.03, 0.03)),
            z=draw(st.floats(-0.31, -0.26)),
            yaw=side * yaw,
            pitch=draw(small),
            roll=draw(small),
        )

    return foot(1.0), foot(-1.0)


@given(stances())
@settings(max_examples=examples(60))
def test_the_soles_come_to_lie_where_they_are_wanted(stance):
    found = soles(solved(Legs(H25), *stance))
    for wanted, (place, turned) in zip(stance, found, strict=True):
        assert place == pytest.approx([wanted.x, wanted.y, wanted.z], abs=1e-6)
        normal = rotation(wanted)[:, 2]
        assert turned[:, 2] == pytest.approx(normal, abs=1e-6)


@given(stances())
@settings(max_examples=examples(40))
def test_the_difference_of_the_yaws_is_met_by_the_one_motor_of_the_hips(stance):
    found = soles(solved(Legs(H25), *stance))
    wrong = [
        math.asin((rotation(wanted).T @ turned)[1, 0])
        for wanted, (_, turned) in zip(stance, found, strict=True)
    ]
    assert wrong[0] == pytest.approx(wrong[1], abs=5e-3)
    assert abs(wrong[0]) < 0.1


@given(st.lists(stances(), min_size=1, max_size=5), stances())
@settings(max_examples=examples(30))
def test_a_solution_is_the_same_whatever_was_solved_before(before, stance):
    legs = Legs(H25)
    for other in before:
        legs.solve(*other)
    assert legs.solve(*stance) == pytest.approx(Legs(H25).solve(*stance), abs=1e-5)


@given(st.tuples(*(st.floats(*RANGES[joint]) for joint in H25.groups.legs)))
@settings(max_examples=examples(60))
def test_where_the_soles_are_is_where_mujoco_has_them(angles):
    found = soles(dict(zip(H25.groups.legs, angles, strict=True)))
    for (_, side), part, (place, _) in zip(SIDES, (angles[:6], angles[6:]), found, strict=True):
        assert Legs(H25).sole(side, part) == pytest.approx(tuple(place), abs=1e-9)


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), st.floats(-3.0, 3.0))
@settings(max_examples=examples(60))
def test_what_is_out_of_reach_gives_finite_angles_and_a_stretched_leg(x, y, z, yaw):
    far = FootPose(x, y, z, yaw)
    angles = solved(Legs(H25), far, FootPose(0.0, -0.05, -0.31))
    assert all(math.isfinite(angle) for angle in angles.values())
    lower, upper = RANGES["LHipYawPitch"]
    assert lower <= angles["LHipYawPitch"] <= upper
    if math.dist((x, y, z), (0.0, 0.05, -0.085)) > 0.3:
        assert angles["LKneePitch"] == pytest.approx(0.0, abs=1e-3)
