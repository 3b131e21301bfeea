"""Names for the joints of both sides, and whether equal angles of a pair are mirror images."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.bodies import find_body
from naoserver.bodies.kinematics import kinematics_of
from naoserver.bodies.parts import Groups, Joint, Link
from naoserver.body import Body
from naoserver.moves.motion_file import names_of
from tests.support.bodies import CART, GIANT
from tests.support.examples import examples

MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])
H25 = find_body("H25")
DIRECTION = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda axis: math.hypot(*axis) > 0.1)
TURN = st.tuples(st.floats(0.2, 1.0), *[st.floats(-1.0, 1.0)] * 3)
PLACE = st.tuples(*[st.floats(-0.5, 0.5)] * 3)


def unit(vector):
    return tuple(part / math.hypot(*vector) for part in vector)


def pairs_of(body):
    return {name: joints for name, joints in names_of(body).items() if len(joints) == 2}


def assert_mirrored(body, angles, tolerance):
    """Check that the links of each pair are mirror images of each other."""
    place_of = kinematics_of(body).place_of
    for left, right in pairs_of(body).values():
        mirrored = MIRROR @ place_of(left, angles) @ MIRROR
        assert place_of(right, angles) == pytest.approx(mirrored, abs=tolerance)


@pytest.mark.parametrize("body", [H25, find_body("T1"), find_body("G1"), GIANT], ids=lambda body: body.name)
@settings(max_examples=examples(10))
@given(st.data())
def test_a_pose_by_names_of_both_sides_is_its_own_mirror_image(body, data):
    angles: dict[str, float] = {}
    for joints in pairs_of(body).values():
        angle = data.draw(st.floats(-1.5, 1.5))
        angles |= {joint: sign * angle for joint, sign in joints.items()}
    # A Nao's hands are open at 1, whatever the axes of their massless fingers.
    angles |= {joint: 0.0 for joint in angles if joint.endswith("Hand")}
    coupled = {follower: pair.of(angles.get(pair.leader, 0.0)) for follower, pair in body.following.items()}
    assert_mirrored(body, angles | coupled, 1e-4)


@st.composite
def mirrored_limbs(draw):
    """Draw a body whose right arm is the left one's mirror image, its axes perhaps reversed."""
    joints, before = [], ("trunk", "trunk")
    for number in range(draw(st.integers(1, 4))):
        (x, y, z), (w, a, b, c) = draw(PLACE), unit(draw(TURN))
        axis, sign = unit(draw(DIRECTION)), draw(st.sampled_from((1, -1)))
        reflected = (-sign * axis[0], sign * axis[1], -sign * axis[2])
        common: dict[str, Any] = {"lower": -2.0, "upper": 2.0, "max_velocity": 1.0, "max_torque": 1.0}
        links = f"left_{number}", f"right_{number}"
        joints += [
            Joint(name=f"left_arm_{number}", parent=before[0], child=links[0], axis=axis, origin=(x, y, z),
                  turn=(w, a, b, c), **common),
            Joint(name=f"right_arm_{number}", parent=before[1], child=links[1], axis=reflected,
                  origin=(x, -y, z), turn=(w, -a, b, -c), **common),
        ]  # fmt: skip
        before = links
    names = [joint.name for joint in joints]
    parts = tuple(Link(name=name, mass=1.0) for name in ("trunk", *(joint.child for joint in joints)))
    groups = Groups(left_arm=tuple(names[::2]), right_arm=tuple(names[1::2]))
    return Body(name="own", links=parts, joints=tuple(joints), groups=groups)


@settings(max_examples=examples(40))
@given(st.data(), mirrored_limbs())
def test_any_limb_and_its_mirror_image_move_as_in_a_mirror(data, body):
    angles: dict[str, float] = {}
    for number, joints in enumerate(pairs_of(body).values()):
        assert list(joints) == [f"left_arm_{number}", f"right_arm_{number}"]
        angle = data.draw(st.floats(-1.5, 1.5))
        angles |= {joint: sign * angle for joint, sign in joints.items()}
    assert_mirrored(body, angles, 1e-6)


def test_the_names_of_a_nao():
    names = names_of(H25)
    assert names["HeadYaw"] == {"HeadYaw": 1.0}
    assert names["ShoulderRoll"] == {"LShoulderRoll": 1.0, "RShoulderRoll": -1.0}
    assert names["KneePitch"] == {"LKneePitch": 1.0, "RKneePitch": 1.0}
    assert names["Hand"] == {"LHand": 1.0, "RHand": 1.0}
    assert names["HipYawPitch"] == {"LHipYawPitch": 1.0}
    assert not {"LHipYawPitch", "RHipYawPitch"} & names.keys(), "one motor has one name"
    assert len(names) == 26 - 2 + 12


@pytest.mark.parametrize(
    ("body", "name", "pair"),
    [
        (find_body("T1"), "Shoulder_Roll", ["Left_Shoulder_Roll", "Right_Shoulder_Roll"]),
        (find_body("G1"), "knee_joint", ["left_knee_joint", "right_knee_joint"]),
        (GIANT, "swing", ["port_swing", "starboard_swing"]),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_a_name_without_the_side_is_that_of_a_pair(body, name, pair):
    assert list(names_of(body)[name]) == pair


def test_joints_that_are_no_pair_have_only_their_own_names():
    assert names_of(CART) == {name: {name: 1.0} for name in CART.joint_names}
