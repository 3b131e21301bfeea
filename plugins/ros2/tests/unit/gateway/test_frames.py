"""The frames of a body in ROS."""

import pytest

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.parts import Camera, Groups, Joint, Link, Sole, TouchSensor
from naoserver.body import Body
from tests.support.bodies import ARM, CART, GIANT
from visualhfsm_ros2.gateway._frames import ODOM, ROOT, fixed_frames, link_frames

BODIES = [*map(find_body, BODY_NAMES), ARM, CART, GIANT]


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
def test_frames_follow_their_parents_and_no_two_are_equal(body):
    links = link_frames(body)
    known = {ROOT, *(links[joint.child] for joint in body.joints)}
    for frame in fixed_frames(body):
        assert frame.parent in known
        assert frame.name not in known
        known.add(frame.name)
    assert set(links.values()) <= known


@pytest.mark.parametrize("name", ["H25", "H21"])
def test_the_frames_of_a_nao_have_the_names_of_its_driver(name):
    body = find_body(name)
    links = link_frames(body)
    assert links["torso"] == "torso"
    assert links["l_foot"] == "l_ankle"
    assert links["r_fingers"] == "r_gripper"
    assert links["l_upper_arm"] == "LBicep"
    frames = {frame.name: frame.parent for frame in fixed_frames(body)}
    assert {
        "torso": ROOT, "gaze": "Head", "l_sole": "l_ankle", "r_sole": "r_ankle",
        "CameraTop_frame": "Head", "CameraBottom_optical_frame": "CameraBottom_frame",
        "ImuTorsoAccelerometer_frame": "torso", "ImuTorsoGyrometer_frame": "torso", "LSonar_frame": "torso",
        "RFsrFL_frame": "r_ankle", "ChestButton_frame": "torso", "HeadTouchRear_frame": "Head",
        "LFootBumperLeft_frame": "l_ankle",
    }.items() <= frames.items()  # fmt: skip
    assert ("LHandTouchBack_frame" in frames) is (name == "H25")


def test_what_a_body_lacks_has_no_frame():
    assert [frame.name for frame in fixed_frames(ARM)] == ["base"]


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
def test_only_a_body_with_a_neck_has_a_gaze(body):
    assert ("gaze" in {frame.name for frame in fixed_frames(body)}) is (body.neck is not None)


def joint(parent, child):
    return Joint(
        name=f"to {child}", parent=parent, child=child, axis=(1, 0, 0), origin=(0, 0, 0), max_velocity=1,
        max_torque=1,
    )  # fmt: skip


def body_of(*names, **parts):
    """Return a body whose links all hang on the first."""
    links = tuple(Link(name=name, mass=1.0) for name in names)
    return Body(name="own", links=links, joints=tuple(joint(names[0], name) for name in names[1:]), **parts)


def test_links_that_are_called_like_a_frame_of_the_robot_have_another_name():
    body = body_of("base_footprint", "base_link", "odom", "odom_")
    assert [*link_frames(body).values()] == ["base_footprint_", "base_link_", "odom_", "odom__"]


def test_a_root_that_is_called_base_link_is_the_root_of_the_tree():
    body = body_of("base_link", "arm")
    assert link_frames(body) == {"base_link": ROOT, "arm": "arm"}
    assert fixed_frames(body) == []


def test_a_link_that_is_called_like_a_sensor_stands_for_it():
    outline = ((0.1, 0.1), (-0.1, 0.1), (0.0, -0.1))
    body = body_of(
        "trunk", "l_sole", "r_foot", soles=tuple(Sole(link=at, outline=outline, height=0.1) for at in ("l_sole", "r_foot"))
    )  # fmt: skip
    assert [frame.name for frame in fixed_frames(body)] == ["trunk", "r_sole"]


def test_a_sensor_cannot_take_the_place_of_the_odometry():
    camera = Camera(
        name="Camera", link="trunk", position=(0, 0, 0), tilt=0.0, horizontal_fov=1.0, sizes=((4, 3),), rates=(1,),
        ros_name="same",
    )  # fmt: skip
    touch = {"same": TouchSensor(link="trunk"), "Skin": TouchSensor(link="trunk", ros_name="Skin")}
    body = body_of("trunk", "same_optical_frame", cameras=(camera,), touch=touch, groups=Groups())
    assert [frame.name for frame in fixed_frames(body)] == ["trunk", "same_frame", "Skin_frame"]
    assert ODOM not in {frame.name for frame in fixed_frames(body)}
