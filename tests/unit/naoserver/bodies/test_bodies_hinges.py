"""The axes of hinges mean the same on each humanoid: at the same angles limbs point where those of an H25 do."""

import math
from itertools import product

import numpy as np
import pytest

from naoserver.bodies import find_body
from naoserver.bodies.kinematics import kinematics_of
from naoserver.bodies.parts import Axis

H25 = find_body("H25")
INCLINED = {"T1": math.radians(0.1), "G1": math.radians(16.1)}
"""Largest angle in rad by which an arm points elsewhere: the G1's shoulders are inclined."""
SHOULDER = list(product((math.pi / 2, 0.7, 0.0, -1.4), (0.0, 0.4, 1.0)))
ELBOW = list(product((-1.8, -1.0, -0.2), (0.0, -0.7, -1.4)))
TURN = 0.3


def angles_of(body, hinges):
    """Return angles of joints at which the axes of hinges are at some angles, all others at 0."""
    joints = dict.fromkeys(body.joint_names, 0.0)
    for (hinge, axis), angle in hinges.items():
        facts = body.hinges[hinge][axis]
        joints[facts.joint] = facts.joint_angle(angle)
    return joints


def turn_between(one, other):
    """Return the rotation vector in rad from one place to another."""
    turned = other[:3, :3] @ one[:3, :3].T
    angle = math.acos(max(-1.0, min(1.0, (np.trace(turned) - 1) / 2)))
    if angle < 1e-9:
        return np.zeros(3)
    axis = np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
    return axis / (2 * math.sin(angle)) * angle


@pytest.fixture(params=INCLINED)
def body(request):
    return find_body(request.param)


@pytest.mark.parametrize(("side", "effector", "sign"), [("Left", "LArm", 1), ("Right", "RArm", -1)])
def test_arms_point_where_those_of_a_nao_do(body, side, effector, sign):
    for (tilt, roll), (pan, bend) in product(SHOULDER, ELBOW):
        axes = {
            (f"{side}Shoulder", Axis.TILT): tilt,
            (f"{side}Shoulder", Axis.ROLL): sign * roll,
            (f"{side}Elbow", Axis.PAN): sign * pan,
            (f"{side}Elbow", Axis.ROLL): sign * bend,
        }
        hands = [kinematics_of(each).place_of(effector, angles_of(each, axes)) for each in (H25, body)]
        assert np.linalg.norm(turn_between(*hands)) <= INCLINED[body.name], axes


@pytest.mark.parametrize("side", ["Left", "Right"])
@pytest.mark.parametrize(
    ("tilt", "direction"), [(0.0, (1, 0, 0)), (math.pi / 2, (0, 0, -1)), (-math.pi / 2, (0, 0, 1))]
)
def test_an_arm_is_forward_at_tilt_0_and_hangs_at_a_right_angle(body, side, tilt, direction):
    axes = {
        (f"{side}Shoulder", Axis.TILT): tilt,
        (f"{side}Shoulder", Axis.ROLL): 0.0,
        (f"{side}Elbow", Axis.PAN): 0.0,
        (f"{side}Elbow", Axis.ROLL): 0.0,
    }
    hand = kinematics_of(body).place_of("LArm" if side == "Left" else "RArm", angles_of(body, axes))
    angle = math.acos(min(1.0, float(hand[:3, 0] @ direction)))
    assert angle <= INCLINED[body.name]


@pytest.mark.parametrize(
    ("hinge", "axis", "effector", "about"),
    [
        ("Neck", Axis.PAN, "Camera", (0, 0, 1)),
        ("Neck", Axis.TILT, "Camera", (0, 1, 0)),
        ("LeftHip", Axis.TILT, "LLeg", (0, 1, 0)),
        ("RightHip", Axis.TILT, "RLeg", (0, 1, 0)),
        ("LeftHip", Axis.ROLL, "LLeg", (1, 0, 0)),
        ("RightHip", Axis.ROLL, "RLeg", (1, 0, 0)),
        ("LeftHip", Axis.PAN, "LLeg", (0, 0, -1)),
        ("RightHip", Axis.PAN, "RLeg", (0, 0, 1)),
        ("LeftKnee", Axis.TILT, "LLeg", (0, 1, 0)),
        ("RightKnee", Axis.TILT, "RLeg", (0, 1, 0)),
        ("LeftAnkle", Axis.TILT, "LLeg", (0, 1, 0)),
        ("RightAnkle", Axis.TILT, "RLeg", (0, 1, 0)),
        ("LeftAnkle", Axis.ROLL, "LLeg", (1, 0, 0)),
        ("RightAnkle", Axis.ROLL, "RLeg", (1, 0, 0)),
    ],
)
def test_a_positive_angle_turns_as_on_a_nao(body, hinge, axis, effector, about):
    def turned(each):
        kinematics, part = kinematics_of(each), effector
        if part not in each.effectors:
            part = "CameraTop"
        places = [
            kinematics.place_of(part, change)
            for change in (angles_of(each, {(hinge, axis): 0.0}), angles_of(each, {(hinge, axis): TURN}))
        ]
        return turn_between(*places)

    turn = turned(body)
    assert np.linalg.norm(turn) == pytest.approx(TURN, abs=1e-3)
    assert turn @ about > 0.97 * TURN
    # A Nao's hip turns about an axis between that and the one of its pitch.
    assert turn @ turned(H25) > 0.6 * TURN**2


def test_the_waist_of_a_t1_turns_its_trunk_to_the_left():
    body = find_body("T1")
    kinematics = kinematics_of(body)
    feet = [kinematics.soles(angles_of(body, {("Waist", Axis.PAN): angle}))[0] for angle in (0.0, TURN)]
    assert turn_between(*feet) == pytest.approx((0, 0, -TURN), abs=1e-6)


@pytest.mark.parametrize("side", ["Left", "Right"])
def test_the_wrist_of_a_g1_turns_about_the_forearm(side):
    body = find_body("G1")
    kinematics, hand = kinematics_of(body), "LArm" if side == "Left" else "RArm"
    hands = [
        kinematics.place_of(hand, angles_of(body, {(f"{side}Wrist", Axis.PAN): angle}))
        for angle in (0.0, TURN)
    ]
    assert turn_between(*hands) == pytest.approx(TURN * hands[0][:3, 0], abs=1e-6)
