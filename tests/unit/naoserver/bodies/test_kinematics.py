"""The positions of the body's parts: compared with MuJoCo, and with measurements at rest."""

import math
from itertools import product

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from naoserver.bodies import find_body
from naoserver.bodies.kinematics import angles_of, kinematics_of, matrix_of, neighbors_of, rotation, turned
from naoserver.bodies.parts import Joint, Link, Place, Shape, Sole
from naoserver.body import Body
from naoserver.errors import InvalidCommand
from tests.support.examples import examples
from tests.support.linkage import LINKAGE

pytestmark = pytest.mark.sim

H25 = find_body("H25")
DIRECTION = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda axis: math.hypot(*axis) > 0.1)
PLACE = st.tuples(*[st.floats(-0.5, 0.5)] * 3)
UPRIGHT = {"HeadYaw": 0.0}


def unit(vector):
    return tuple(part / math.hypot(*vector) for part in vector)


@st.composite
def joints(draw, number):
    """Draw the joint that carries a link, by any link before it."""
    return Joint(
        name=f"joint {number}",
        parent=f"link {draw(st.integers(0, number - 1))}",
        child=f"link {number}",
        axis=unit(draw(DIRECTION)),
        origin=draw(PLACE),
        turn=unit((draw(st.floats(0.2, 1.0)), *draw(DIRECTION))),
        lower=-2.0,
        upper=2.0,
        max_velocity=1.0,
        max_torque=1.0,
        sliding=draw(st.booleans()),
    )


@st.composite
def bodies(draw):
    """Draw a tree of links; the last but one is fixed, and the last is an effector."""
    carried = [draw(joints(number)) for number in range(1, draw(st.integers(3, 8)))]
    links = ["link 0", *(joint.child for joint in carried)]
    return Body(
        name="tree",
        links=tuple(Link(name=link, mass=draw(st.floats(0.1, 2.0)), com=draw(PLACE)) for link in links),
        joints=tuple(joint for joint in carried if joint is not carried[-2]),
        fixed_joints=(carried[-2],),
        effectors={"tip": Place(link=links[-1], position=draw(PLACE), angles=draw(PLACE))},
    )


def in_mujoco(body, angles):
    """Return the data of a body in MuJoCo with its joints at some angles."""
    spec = mujoco.MjSpec()
    made = {body.root.name: spec.worldbody.add_body(name=body.root.name)}
    for link in body.links[1:]:
        joint = body.moved_by[link.name]
        child = made[joint.parent].add_body(name=link.name, pos=joint.origin, quat=joint.turn)
        made[link.name] = child
        if joint.name in body.joint:
            kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.sliding else mujoco.mjtJoint.mjJNT_HINGE
            child.add_joint(name=joint.name, type=kind, axis=joint.axis)
    for link in body.links:
        made[link.name].mass = link.mass
        made[link.name].ipos = link.com
        made[link.name].inertia = [1.0] * 3
        made[link.name].explicitinertial = True
    model = spec.compile()
    data = mujoco.MjData(model)
    for joint, angle in angles.items():
        data.joint(joint).qpos[0] = angle
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data


def drawn_angles(data, body):
    return {joint.name: data.draw(st.floats(-2.0, 2.0)) for joint in body.joints}


@settings(max_examples=examples(40))
@given(st.data(), bodies())
def test_links_of_any_tree_are_where_mujoco_has_them(data, body):
    angles = drawn_angles(data, body)
    kinematics, theirs = kinematics_of(body), in_mujoco(body, angles)
    for link in body.links:
        place = kinematics.link_place(link.name, angles)
        assert place[:3, 3] == pytest.approx(theirs.body(link.name).xpos, abs=1e-9)
        assert place[:3, :3] == pytest.approx(theirs.body(link.name).xmat.reshape(3, 3), abs=1e-9)
    for joint in body.joints:
        assert (kinematics.place_of(joint.name, angles) == kinematics.link_place(joint.child, angles)).all()
    tip = body.effectors["tip"]
    at = kinematics.link_place(tip.link, angles) @ matrix_of((*tip.position, *tip.angles))
    assert kinematics.place_of("tip", angles) == pytest.approx(at, abs=1e-12)


@settings(max_examples=examples(40))
@given(st.data(), bodies())
def test_the_center_of_mass_of_any_tree_is_that_of_mujoco(data, body):
    angles = drawn_angles(data, body)
    mass, center = kinematics_of(body).center_of_mass("Body", angles)
    assert mass == pytest.approx(body.mass)
    assert center == pytest.approx(in_mujoco(body, angles).subtree_com[1], abs=1e-6)


@settings(max_examples=examples(20), deadline=None)
@given(st.data(), bodies())
def test_an_effector_of_any_tree_reaches_a_place_near_by(data, body):
    angles = drawn_angles(data, body)
    near = {name: 0.97 * angle + data.draw(st.floats(-0.05, 0.05)) for name, angle in angles.items()}
    kinematics = kinematics_of(body)
    goal = kinematics.place_of("tip", near)
    found = kinematics.reach({"tip": (goal, [True] * 6)}, angles)
    before = np.linalg.norm(kinematics.place_of("tip", angles) - goal)
    assert np.linalg.norm(kinematics.place_of("tip", found) - goal) <= max(0.02 * float(before), 1e-3)
    assert all(joint.lower <= found[joint.name] <= joint.upper for joint in body.joints)


def test_a_coupled_joint_moves_with_the_joint_of_a_reaching_limb():
    angles, kinematics = dict(H25.postures["StandInit"].angles), kinematics_of(H25)
    turned_hips = angles | {"LHipYawPitch": -0.2, "RHipYawPitch": -0.2}
    found = kinematics.reach({"RLeg": (kinematics.place_of("RLeg", turned_hips), [True] * 6)}, angles)
    assert found["RHipYawPitch"] == found["LHipYawPitch"] == pytest.approx(-0.2, abs=0.01)
    assert found["LHipRoll"] == angles["LHipRoll"]


def test_a_reaching_limb_moves_its_followers_by_their_ratio_and_no_passive_joint():
    tips = {"thumb": Place(link="thumb"), "rod": Place(link="rod", position=(0.2, 0.0, 0.0))}
    kinematics = kinematics_of(replace(LINKAGE, effectors=tips))
    angles = {"drive": 0.0, "pin": 0.0, "grip": 0.0, "pinch": 0.1}
    wanted = {"drive": 0.2, "pin": 0.1, "grip": 0.3, "pinch": -0.5}
    goals = {tip: (kinematics.place_of(tip, wanted), [True] * 6) for tip in tips}
    found = kinematics.reach(goals, angles)
    assert (found["grip"], found["pinch"], found["pin"]) == pytest.approx((0.3, -0.5, 0.0), abs=0.02)


def test_effectors_at_rest():
    angles = dict.fromkeys(H25.joint_names, 0.0)
    place_of = kinematics_of(H25).place_of
    assert place_of("LArm", angles)[0, 3] == pytest.approx(0.2187, abs=1e-9)
    assert place_of("RLeg", angles)[2, 3] == pytest.approx(-0.33309)
    camera = place_of("CameraTop", angles)
    assert camera[2, 3] == pytest.approx(0.1265 + 0.06364)
    assert angles_of(camera) == pytest.approx((0.0, H25.cameras[0].tilt, 0.0))


def test_an_unknown_part_is_refused():
    with pytest.raises(InvalidCommand, match="there is no part 'Tail'; there are Torso, Head, LArm"):
        kinematics_of(H25).place_of("Tail", UPRIGHT)
    with pytest.raises(InvalidCommand, match="there is no part 'Tail'; there are Body, Torso"):
        kinematics_of(H25).center_of_mass("Tail", UPRIGHT)
    with pytest.raises(InvalidCommand, match="no part 'LWristYaw'"):
        kinematics_of(find_body("H21")).place_of("LWristYaw", UPRIGHT)


def on_the_floor(*shapes, soles=()):
    """Return how high the root is above the floor of a body with some shapes on its only moving link."""
    wheel = Joint(
        name="wheel", parent="root", child="wheel", axis=(0, 1, 0), origin=(0.1, 0, -0.2),
        lower=-math.inf, upper=math.inf, max_velocity=1.0, max_torque=1.0,
    )  # fmt: skip
    links = Link(name="root", mass=1.0), Link(name="wheel", mass=1.0)
    body = Body(name="cart", links=links, joints=(wheel,), shapes=shapes, soles=soles)
    return lambda angle=0.0, roll=0.0, pitch=0.0: kinematics_of(body).torso_place(
        {"wheel": angle}, roll, pitch
    )[2, 3]


def test_a_body_without_soles_stands_on_its_lowest_shape():
    sideways = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    wheel = Shape(link="wheel", kind="cylinder", size=(0.1, 0.02), turn=sideways)
    height = on_the_floor(wheel, Shape(link="root", kind="sphere", size=(0.05,)))
    assert height() == pytest.approx(0.3)
    assert height(angle=1.3) == pytest.approx(0.3)
    assert height(pitch=0.4) == pytest.approx(0.1 + 0.1 * math.sin(0.4) + 0.2 * math.cos(0.4))
    rolled = 0.2 * math.cos(0.3) + 0.1 * math.cos(0.3) + 0.02 * math.sin(0.3)
    assert height(roll=0.3) == pytest.approx(rolled)


def test_a_body_without_soles_and_shapes_is_on_the_floor():
    assert on_the_floor()() == 0.0


@pytest.mark.parametrize(
    ("shape", "depth"),
    [
        (Shape(link="root", kind="sphere", size=(0.3,)), 0.3),
        (Shape(link="root", kind="capsule", size=(0.1, 0.4)), 0.5),
        (Shape(link="root", kind="capsule", size=(0.1,), ends=((0, 0, 0.2), (0, 0, -0.3))), 0.4),
        (Shape(link="root", kind="ellipsoid", size=(0.1, 0.2, 0.7)), 0.7),
        (Shape(link="root", kind="box", size=(0.1, 0.2, 0.3), position=(0, 0, -0.1)), 0.4),
        (Shape(link="root", kind="hull", points=((0, 0, 0), (1, 0, 0.2), (0, 1, 0.3), (0, 0, -0.4))), 0.4),
    ],
)
def test_the_lowest_point_of_each_shape(shape, depth):
    assert on_the_floor(shape)() == pytest.approx(depth)


@settings(max_examples=examples(40))
@given(st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5))
def test_the_lowest_point_of_a_tilted_box_is_a_corner(roll, pitch):
    size = (0.1, 0.2, 0.3)
    tilted = rotation((0, 1, 0), pitch) @ rotation((1, 0, 0), roll)
    corners = [(tilted @ [*np.multiply(signs, size), 1.0])[2] for signs in product((1, -1), repeat=3)]
    height = on_the_floor(Shape(link="root", kind="box", size=size))
    assert height(roll=roll, pitch=pitch) == pytest.approx(-min(corners))


def test_a_body_with_soles_stands_on_the_lower_one():
    outline = ((0.0, 0.0), (0.1, 0.0), (0.0, 0.1))
    soles = tuple(Sole(link=link, outline=outline, height=0.05) for link in ("root", "wheel"))
    assert on_the_floor(Shape(link="root", kind="sphere", size=(9.0,)), soles=soles)() == pytest.approx(0.25)


def test_angles_are_those_about_x_then_y_then_z():
    turned_by = rotation((0, 0, 1), 0.3) @ rotation((0, 1, 0), -0.2) @ rotation((1, 0, 0), 0.1)
    assert angles_of(turned_by) == pytest.approx((0.1, -0.2, 0.3))


def test_a_quaternion_turns_as_its_axis_and_angle():
    axis = unit((1.0, 2.0, -0.5))
    quaternion = (math.cos(0.35), *(math.sin(0.35) * part for part in axis))
    assert turned(quaternion) == pytest.approx(rotation(axis, 0.7))
    assert (turned((1.0, 0.0, 0.0, 0.0)) == np.eye(4)).all()


@pytest.mark.parametrize(
    ("first", "second", "neighbors"),
    [
        ("torso", "l_thigh", True),
        ("torso", "head", True),
        ("l_thigh", "l_tibia", True),
        ("l_tibia", "l_foot", True),
        ("torso", "l_forearm", False),
        ("l_thigh", "r_thigh", False),
        ("l_thigh", "l_foot", False),
        ("l_pelvis", "r_pelvis", False),
    ],
)
def test_neighbors_are_what_one_joint_or_one_point_joins(first, second, neighbors):
    assert neighbors_of(H25)(first, second) is neighbors
    assert neighbors_of(H25)(second, first) is neighbors
