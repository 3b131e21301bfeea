"""The URDF against the body that it describes."""

import math
import random
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.kinematics import kinematics_of, matrix_of, rotation
from naoserver.bodies.parts import Joint, Link, Shape
from naoserver.body import Body
from tests.support.bodies import ARM, CART, GIANT
from tests.support.linkage import LINKAGE
from visualhfsm_ros2.gateway._frames import ROOT, link_frames, urdf

H25 = find_body("H25")
CORNERS = tuple((x, y, z) for x in (0.0, 0.2) for y in (0.0, 0.4) for z in (0.0, 0.6))
BODIES = [*map(find_body, BODY_NAMES), ARM, CART, GIANT]


@pytest.fixture(scope="module", params=BODIES, ids=lambda body: body.name)
def body(request):
    return request.param


@pytest.fixture(scope="module")
def robot(body):
    return ET.fromstring(urdf(body))


def floats(text):
    return tuple(float(part) for part in text.split())


def origin(joint):
    element = joint.find("origin")
    return matrix_of((*floats(element.get("xyz")), *floats(element.get("rpy"))))


def joints_of(robot):
    return {joint.find("child").get("link"): joint for joint in robot.iter("joint")}


def place_in_urdf(robot, link, angles):
    """Return the place of a link in the root's frame by the URDF alone."""
    joints, place = joints_of(robot), np.eye(4)
    while link in joints:
        joint = joints[link]
        moved = np.eye(4)
        if joint.get("type") != "fixed":
            axis, angle = floats(joint.find("axis").get("xyz")), angles[joint.get("name")]
            if joint.get("type") == "prismatic":
                moved[:3, 3] = np.multiply(axis, angle)
            else:
                moved = rotation(axis, angle)
        place = origin(joint) @ moved @ place
        link = joint.find("parent").get("link")
    assert link == ROOT
    return place


def drawn_angles(body, seed):
    draw = random.Random(seed)
    return {joint.name: draw.uniform(max(joint.lower, -3), min(joint.upper, 3)) for joint in body.joints}


def test_every_joint_has_the_limits_axis_and_origin_of_the_body(body, robot):
    joints = {joint.get("name"): joint for joint in robot.iter("joint") if joint.get("type") != "fixed"}
    assert [*joints] == [*body.joint_names]
    for facts in body.joints:
        joint, limit = joints[facts.name], joints[facts.name].find("limit")
        assert floats(joint.find("axis").get("xyz")) == pytest.approx(facts.axis)
        assert floats(joint.find("origin").get("xyz")) == pytest.approx(facts.origin)
        found = {name: float(value) for name, value in limit.attrib.items()}
        expected = {"velocity": facts.max_velocity, "effort": facts.max_torque}
        if math.isfinite(facts.upper):
            expected |= {"lower": facts.lower, "upper": facts.upper}
        assert found == pytest.approx(expected)


def test_the_links_are_one_tree_below_base_link(robot):
    links = [link.get("name") for link in robot.iter("link")]
    assert len(links) == len(set(links))
    assert set(links) == {ROOT, *joints_of(robot)}
    names = [joint.get("name") for joint in robot.iter("joint")]
    assert len(names) == len(set(names)) == len(links) - 1


def test_masses_are_those_of_the_body(body, robot):
    masses = sum(float(mass.get("value")) for mass in robot.iter("mass"))
    assert masses == pytest.approx(body.mass, abs=1e-4)


def test_forward_kinematics_agree_in_random_postures(body, robot):
    kinematics, links = kinematics_of(body), link_frames(body)
    for seed in range(5):
        angles = drawn_angles(body, seed)
        for link, frame in links.items():
            expected = kinematics.link_place(link, angles)
            assert place_in_urdf(robot, frame, angles) == pytest.approx(expected, abs=1e-7)
        for name, sole in zip(("l_sole", "r_sole"), kinematics.soles(angles), strict=False):
            assert place_in_urdf(robot, name, angles) == pytest.approx(sole, abs=1e-7)


def test_cameras_are_where_naoqi_has_them():
    robot, angles = ET.fromstring(urdf(H25)), drawn_angles(H25, 1)
    for camera in ("CameraTop", "CameraBottom"):
        expected = kinematics_of(H25).place_of(camera, angles)
        assert place_in_urdf(robot, f"{camera}_frame", angles) == pytest.approx(expected, abs=1e-7)


def test_an_optical_frame_looks_along_z_with_x_to_the_right():
    still = dict.fromkeys(H25.joint_names, 0.0)
    optical = place_in_urdf(ET.fromstring(urdf(H25)), "CameraTop_optical_frame", still)
    assert optical[:3, 0] == pytest.approx((0.0, -1.0, 0.0), abs=1e-6)
    assert optical[:3, 2] == pytest.approx((math.cos(0.0209), 0.0, -math.sin(0.0209)), abs=1e-6)


def test_both_hips_are_one_motor():
    mimic = {joint.get("name"): joint.find("mimic") for joint in ET.fromstring(urdf(H25)).iter("joint")}
    assert [name for name, element in mimic.items() if element is not None] == ["RHipYawPitch"]
    (both,) = (element for element in mimic.values() if element is not None)
    assert both.attrib == {"joint": "LHipYawPitch", "multiplier": "1", "offset": "0"}


def test_a_follower_mimics_with_its_ratio_and_offset():
    (mimic,) = ET.fromstring(urdf(LINKAGE)).iter("mimic")
    assert mimic.attrib == {"joint": "grip", "multiplier": "-2", "offset": "0.1"}


def test_a_body_is_called_by_its_title():
    assert [ET.fromstring(urdf(find_body(name))).get("name") for name in ("H25", "T1")] == [
        "nao_h25",
        "booster_t1",
    ]


def test_shapes_lie_along_their_axes():
    thigh = next(link for link in ET.fromstring(urdf(H25)).iter("link") if link.get("name") == "LThigh")
    shape = next(each for each in thigh.iter("collision") if each.find("geometry/cylinder") is not None)
    along = origin(shape)[:3, 2]
    axis = np.array([0.33826, -0.09364, -0.93638])
    assert along == pytest.approx(axis / np.linalg.norm(axis), abs=1e-4)


@pytest.mark.parametrize(
    ("shape", "tag", "attributes"),
    [
        (Shape(link="root", kind="sphere", size=(0.1,)), "sphere", {"radius": "0.1"}),
        (Shape(link="root", kind="box", size=(0.1, 0.2, 0.3)), "box", {"size": "0.2 0.4 0.6"}),
        (Shape(link="root", kind="ellipsoid", size=(0.1, 0.2, 0.3)), "box", {"size": "0.2 0.4 0.6"}),
        (
            Shape(link="root", kind="cylinder", size=(0.1, 0.2)),
            "cylinder",
            {"radius": "0.1", "length": "0.4"},
        ),
        (Shape(link="root", kind="capsule", size=(0.1, 0.2)), "cylinder", {"radius": "0.1", "length": "0.6"}),
        (Shape(link="root", kind="hull", points=CORNERS), "box", {"size": "0.2 0.4 0.6"}),
        (
            Shape(link="root", kind="capsule", size=(0.1,), ends=((0, 0, 0), (0, 0, 0))),
            "cylinder",
            {"radius": "0.1", "length": "0.2"},
        ),
    ],
)
def test_each_shape_is_as_large_as_that_of_the_body(shape, tag, attributes):
    body = Body(name="one", links=(Link(name="root", mass=1.0),), shapes=(shape,))
    (geometry,) = ET.fromstring(urdf(body)).iterfind("link/collision/geometry")
    assert [(each.tag, each.attrib) for each in geometry] == [(tag, attributes)]


def test_joints_turn_without_end_or_slide():
    links = tuple(Link(name=name, mass=1.0) for name in ("root", "wheel", "lift"))
    common: dict[str, Any] = {
        "parent": "root",
        "axis": (0, 0, 1),
        "origin": (0, 0, 0),
        "max_velocity": 1,
        "max_torque": 1,
    }
    joints = (
        Joint(name="spin", child="wheel", **common),
        Joint(name="rise", child="lift", sliding=True, **common),
    )
    robot = ET.fromstring(urdf(Body(name="own", links=links, joints=joints)))
    kinds = {joint.get("name"): joint.get("type") for joint in robot.iter("joint")}
    assert (kinds["spin"], kinds["rise"]) == ("continuous", "prismatic")
    ends = [limit.get("upper") for limit in robot.iter("limit")]
    assert ends == [None, "1000000"]


@pytest.mark.sim
def test_another_reader_of_urdf_has_every_link_in_the_same_place(body):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(urdf(body))
    data, angles = mujoco.MjData(model), drawn_angles(body, 5)
    for name, angle in angles.items():
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(model, data)
    for joint in body.joints:
        link = data.body(link_frames(body)[joint.child])
        expected = kinematics_of(body).link_place(joint.child, angles)
        assert link.xpos == pytest.approx(expected[:3, 3], abs=1e-6)
        assert link.xmat.reshape(3, 3) == pytest.approx(expected[:3, :3], abs=1e-6)
