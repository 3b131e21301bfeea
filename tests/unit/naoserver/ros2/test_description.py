"""The URDF and the fixed frames against the facts of the body."""

import math
import random
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from naoserver.body import H21, H25
from naoserver.kinematics import matrix_of, place_of, rotation
from naoserver.ros2._description import LINKS, ROOT, body_of, fixed_frames, urdf


@pytest.fixture(scope="module", params=[H25, H21], ids=["H25", "H21"])
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
        turned = np.eye(4)
        if joint.get("type") == "revolute":
            turned = rotation(floats(joint.find("axis").get("xyz")), angles[joint.get("name")])
        place = origin(joint) @ turned @ place
        link = joint.find("parent").get("link")
    assert link == ROOT
    return place


def test_every_joint_has_the_limits_axis_and_origin_of_the_facts(body, robot):
    joints = {joint.get("name"): joint for joint in robot.iter("joint") if joint.get("type") == "revolute"}
    assert [*joints] == [*body.joint_names]
    for facts in body.joints:
        joint, limit = joints[facts.name], joints[facts.name].find("limit")
        assert floats(joint.find("axis").get("xyz")) == pytest.approx(facts.axis)
        assert floats(joint.find("origin").get("xyz")) == pytest.approx(facts.origin)
        found = [float(limit.get(name)) for name in ("lower", "upper", "velocity", "effort")]
        assert found == pytest.approx([facts.lower, facts.upper, facts.max_velocity, facts.max_torque])


def test_the_links_are_one_tree_below_base_link(robot):
    links = [link.get("name") for link in robot.iter("link")]
    assert len(links) == len(set(links))
    assert set(links) == {ROOT, *joints_of(robot)}
    names = [joint.get("name") for joint in robot.iter("joint")]
    assert len(names) == len(set(names)) == len(links) - 1


def test_masses_are_those_of_the_facts(body, robot):
    masses = sum(float(mass.get("value")) for mass in robot.iter("mass"))
    assert masses == pytest.approx(body.facts["checks"]["total_mass"], abs=1e-4)


def test_forward_kinematics_agree_in_random_postures(body, robot):
    draw = random.Random(17)
    for _ in range(20):
        angles = {joint.name: draw.uniform(joint.lower, joint.upper) for joint in body.joints}
        whole = dict.fromkeys(H25.joint_names, 0.0) | angles
        for joint in body.joints:
            expected = place_of(joint.name, whole)
            assert place_in_urdf(robot, LINKS[joint.child], angles) == pytest.approx(expected, abs=1e-7)
        for part, link in (
            ("LLeg", "l_sole"),
            ("RLeg", "r_sole"),
            ("CameraTop", "CameraTop_frame"),
            ("CameraBottom", "CameraBottom_frame"),
        ):
            assert place_in_urdf(robot, link, angles) == pytest.approx(place_of(part, whole), abs=1e-7)


def test_an_optical_frame_looks_along_z_with_x_to_the_right(robot):
    still = dict.fromkeys(H25.joint_names, 0.0)
    optical = place_in_urdf(robot, "CameraTop_optical_frame", still)
    assert optical[:3, 0] == pytest.approx((0.0, -1.0, 0.0), abs=1e-6)
    assert optical[:3, 2] == pytest.approx((math.cos(0.0209), 0.0, -math.sin(0.0209)), abs=1e-6)


def test_both_hips_are_one_motor(robot):
    mimic = {joint.get("name"): joint.find("mimic") for joint in robot.iter("joint")}
    assert [name for name, element in mimic.items() if element is not None] == ["RHipYawPitch"]
    assert mimic["RHipYawPitch"].get("joint") == "LHipYawPitch"


def test_shapes_lie_along_their_axes(robot):
    thigh = next(link for link in robot.iter("link") if link.get("name") == "LThigh")
    place = next(
        shape.find("origin")
        for shape in thigh.iter("collision")
        if shape.find("geometry/cylinder") is not None
    )
    along = matrix_of((0.0, 0.0, 0.0, *floats(place.get("rpy"))))[:3, 2]
    axis = np.array([0.33826, -0.09364, -0.93638])
    assert along == pytest.approx(axis / np.linalg.norm(axis), abs=1e-4)


def test_frames_follow_their_parents(body):
    known = {ROOT, *(LINKS[joint.child] for joint in body.joints)}
    for frame in fixed_frames(body):
        assert frame.parent in known
        known.add(frame.name)
    assert {"gaze", "LSonar_frame", "RFsrFL_frame", "HeadTouchRear_frame", "LFootBumperLeft_frame"} <= known
    assert ("LHandTouchBack_frame" in known) is (body is H25)


def test_a_body_is_known_by_its_joints():
    assert body_of(H25.joint_names) is H25
    assert body_of(H21.joint_names) is H21
    assert body_of(["HeadYaw"]) is None


@pytest.mark.sim
def test_another_reader_of_urdf_has_every_link_in_the_same_place():
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(urdf(H25))
    data, draw = mujoco.MjData(model), random.Random(5)
    angles = {joint.name: draw.uniform(joint.lower, joint.upper) for joint in H25.joints}
    for name, angle in angles.items():
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(model, data)
    for joint in H25.joints:
        link, expected = data.body(LINKS[joint.child]), place_of(joint.name, angles)
        assert link.xpos == pytest.approx(expected[:3, 3], abs=1e-6)
        assert link.xmat.reshape(3, 3) == pytest.approx(expected[:3, :3], abs=1e-6)
