"""Readings of the robot as messages of ROS: every one can be encoded, and has the units and axes of REP 103."""

import math
import random
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from interfaces.jderobot import CameraDescription, EncodersData, ImageData, ImageDescription
from interfaces.nao import (
    BatteryReading,
    FootReading,
    HealthEvent,
    HealthReport,
    InertialReading,
    JointState,
    SafetyState,
    Severity,
    SonarLimits,
    Vector3,
)
from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.kinematics import angles_of, kinematics_of, matrix_of
from naoserver.bodies.parts import Joint, Link
from naoserver.body import Body
from tests.support.bodies import ARM, CART, GIANT
from visualhfsm_ros2.gateway import _messages as messages
from visualhfsm_ros2.gateway._frames import link_frames
from visualhfsm_ros2.gateway._messages import BodyFrames, Stamps
from zenoh_ros2 import Types

H25 = find_body("H25")
HEADER = Stamps(simulated=True).header(1.5, "base_link")


@pytest.fixture(scope="module")
def types():
    return Types()


def sent(types, name, fields):
    """Return what a subscription gets."""
    return types.decode(types.encode(types.make(name, fields)), name)


def test_a_simulation_s_time_is_the_robot_s_to_the_nanosecond():
    stamps = Stamps(simulated=True)
    stamps.adjust(7.0, 1.8e9)
    assert stamps.stamp(12.25) == {"sec": 12, "nanosec": 250_000_000}


def test_a_real_robot_s_time_is_the_date_whatever_its_clock_counts_from():
    stamps = Stamps(simulated=False)
    stamps.adjust(100.0, 1_800_000_000.5)
    assert stamps.stamp(101.0) == {"sec": 1_800_000_001, "nanosec": 500_000_000}
    assert stamps.robot_time(1_800_000_001.5) == pytest.approx(101.0)


def test_joints_have_positions_velocities_and_torques(types):
    state = JointState(1.5, [0.1, 0.2], [0.3, 0.4], [0.0, 0.0], [0.5, 0.6], [1.0, 1.0], [40.0, 41.0])
    message = sent(
        types, "sensor_msgs/msg/JointState", messages.joint_state(HEADER, ["HeadYaw", "HeadPitch"], state)
    )
    assert message.header.stamp.sec == 1
    assert message.name == ["HeadYaw", "HeadPitch"]
    assert [*message.position, *message.velocity, *message.effort] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]


def test_the_inertial_unit_gives_the_tilt_and_no_heading(types):
    reading = InertialReading(1.5, Vector3(0.1, 0.2, 9.8), Vector3(0.3, 0.4, 0.5), 0.2, -0.3)
    message = sent(types, "sensor_msgs/msg/Imu", messages.imu(HEADER, reading))
    turn = message.orientation
    forward = (turn.w**2 + turn.x**2 - turn.y**2 - turn.z**2, 2 * (turn.x * turn.z - turn.w * turn.y))
    assert forward == pytest.approx((math.cos(-0.3), -math.sin(-0.3)))
    assert (message.linear_acceleration.z, message.angular_velocity.y) == (9.8, 0.4)
    assert message.orientation_covariance[8] > 9.0


@pytest.mark.parametrize("distance", [0.4, math.inf])
def test_what_is_out_of_the_sonar_s_range_is_infinite(types, distance):
    fields = messages.sonar(HEADER, distance, SonarLimits(0.25, 2.55, math.radians(60)))
    message = sent(types, "sensor_msgs/msg/Range", fields)
    assert message.range == pytest.approx(distance)
    assert (message.radiation_type, message.min_range) == (0, 0.25)


@pytest.mark.parametrize(("charge", "plugged", "status"), [(0.5, False, 2), (0.5, True, 1), (1.0, True, 4)])
def test_the_battery_charges_discharges_or_is_full(types, charge, plugged, status):
    reading = BatteryReading(1.5, charge, -1.0, 30.0, plugged)
    message = sent(types, "sensor_msgs/msg/BatteryState", messages.battery(HEADER, reading))
    assert (message.percentage, message.power_supply_status) == (charge, status)
    assert math.isnan(message.voltage)


def test_a_foot_has_four_forces(types):
    fields = messages.foot(HEADER, FootReading(1.0, 2.0, 3.0, 4.0, 10.0))
    assert [*sent(types, "naoqi_bridge_msgs/msg/FloatArrayStamped", fields).data] == [1.0, 2.0, 3.0, 4.0]


def test_a_touch_is_one_event_and_a_release_another():
    pressed = {"HeadFront", "LHandBack", "LFootBumperLeft"}
    assert [*messages.touch_events((), pressed)] == [
        ("bumper", {"bumper": 1, "state": 1}),
        ("hand_touch", {"hand": 3, "state": 1}),
        ("head_touch", {"button": 1, "state": 1}),
    ]
    both = {"LFootBumperLeft", "LFootBumperRight"}
    assert [*messages.touch_events(pressed, both)] == [
        ("hand_touch", {"hand": 3, "state": 0}),
        ("head_touch", {"button": 1, "state": 0}),
    ]


def test_pixels_and_projection_of_a_camera(types):
    pixels = bytes(range(24))
    image = ImageData(description=ImageDescription(4, 2, 24, "RGB8"), pixelData=pixels)
    raw = sent(types, "sensor_msgs/msg/Image", messages.raw_image(HEADER, image))
    assert (raw.encoding, raw.step, raw.height, bytes(raw.data)) == ("rgb8", 12, 2, pixels)
    jpeg = sent(types, "sensor_msgs/msg/CompressedImage", messages.compressed_image(HEADER, image))
    assert Image.open(BytesIO(bytes(jpeg.data))).size == (4, 2)
    described = CameraDescription(width=4, height=2, fdistx=3.0, fdisty=3.5, u0=1.5, v0=0.5)
    info = sent(types, "sensor_msgs/msg/CameraInfo", messages.camera_info(HEADER, described))
    point = info.k.reshape(3, 3) @ (0.2, -0.1, 1.0)
    assert point == pytest.approx((1.5 + 0.6, 0.5 - 0.35, 1.0))
    assert info.p.reshape(3, 4)[:, :3] == pytest.approx(info.k.reshape(3, 3))


def warm(*temperatures):
    names = ["HeadYaw", "LHand"][: len(temperatures)]
    return names, JointState(temperatures=[*temperatures], stiffnesses=[1.0] * len(names))


def test_diagnostics_warn_of_what_is_hot_low_fallen_or_stopped(types):
    event = HealthEvent(1.0, Severity.Warning, "HeadYaw", "limited")
    health = HealthReport(events=[event])
    calm = messages.diagnostics(HEADER, health, SafetyState(), warm(40.0), None)
    message = sent(types, "diagnostic_msgs/msg/DiagnosticArray", calm)
    assert [(each.level, each.message) for each in message.status] == [(1, "limited"), (0, "OK"), (0, "OK")]
    health.fallen = True
    stopped = SafetyState(stopped=True, reason="hands off")
    power = BatteryReading(1.0, 0.1, -1.0, 30.0, False)
    grave = messages.diagnostics(HEADER, health, stopped, warm(70.0, 80.0), power)
    message = sent(types, "diagnostic_msgs/msg/DiagnosticArray", grave)
    assert [each.level for each in message.status] == [2, 2, 1, 2, 2]
    assert [each.message for each in message.status][:2] == ["fallen", "hands off"]
    lost = messages.diagnostics(HEADER, health, SafetyState(lost="the cable is out"), warm(40.0), None)
    message = sent(types, "diagnostic_msgs/msg/DiagnosticArray", lost)
    assert [(each.level, each.message) for each in message.status[:2]] == [
        (2, "lost: the cable is out"),
        (0, "OK"),
    ]


# Transforms


def matrix(transform):
    turn, move = transform.rotation, transform.translation
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    assert x * x + y * y + z * z + w * w == pytest.approx(1.0)
    place = np.eye(4)
    place[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    place[:3, 3] = move.x, move.y, move.z
    return place


def place_of_frame(messages_, frame, root):
    above = {each.child_frame_id: each for message in messages_ for each in message.transforms}
    place = np.eye(4)
    while frame != root:
        place = matrix(above[frame].transform) @ place
        frame = above[frame].header.frame_id
    return place


@pytest.mark.parametrize("body", [*map(find_body, BODY_NAMES), ARM, CART, GIANT], ids=lambda body: body.name)
def test_the_tree_of_transforms_has_every_part_where_the_kinematics_do(types, body):
    drawn, frames, kinematics = random.Random(3), BodyFrames(types, body), kinematics_of(body)
    for _ in range(5):
        angles = {
            joint.name: drawn.uniform(max(joint.lower, -9), min(joint.upper, 9)) for joint in body.joints
        }
        tilt = drawn.uniform(-1, 1), drawn.uniform(-1, 1)
        x, y, heading = drawn.uniform(-3, 3), drawn.uniform(-3, 3), drawn.uniform(-3, 3)
        odometry = EncodersData(x, y, heading, math.cos(heading), math.sin(heading))
        floor, place = frames.floor(5, [*angles.values()], tilt, odometry)
        tree = [frames.fixed(5), frames.message([*frames.moving(5, [*angles.values()]), *floor])]
        links = link_frames(body)
        for link, frame in links.items():
            expected = kinematics.link_place(link, angles)
            assert place_of_frame(tree, frame, "base_link") == pytest.approx(expected, abs=1e-9)
        torso = matrix_of((x, y, 0.0, 0.0, 0.0, heading)) @ kinematics.torso_place(angles, *tilt)
        assert place_of_frame(tree, links[body.root.name], "odom") == pytest.approx(torso, abs=1e-9)
        assert place == pytest.approx(torso)
        foot = place_of_frame(tree, "base_footprint", "odom")
        soles = [place_of_frame(tree, sole, "odom") for sole in ("l_sole", "r_sole")] if body.soles else []
        feet = [sole[:2, 3] for sole in soles] or [torso[:2, 3]]
        assert foot[:2, 3] == pytest.approx(np.mean(feet, axis=0))
        assert foot[2, 3] == pytest.approx(min((sole[2, 3] for sole in soles), default=0.0), abs=1e-9)
        assert angles_of(foot) == pytest.approx((0.0, 0.0, heading), abs=1e-9)


def test_a_joint_that_slides_moves_its_link_along_its_axis(types):
    links = tuple(Link(name=name, mass=1.0) for name in ("root", "lift"))
    rise = Joint(
        name="rise", parent="root", child="lift", axis=(0, 0, 1), origin=(0.1, 0, 0.2), sliding=True,
        turn=(math.sqrt(0.5), math.sqrt(0.5), 0, 0), max_velocity=1, max_torque=1,
    )  # fmt: skip
    body = Body(name="lift", links=links, joints=(rise,))
    frames = BodyFrames(types, body)
    tree = [frames.message(frames.moving(5, [0.3])), frames.fixed(5)]
    lift = place_of_frame(tree, "lift", "base_link")
    assert lift == pytest.approx(kinematics_of(body).link_place("lift", {"rise": 0.3}), abs=1e-9)
    assert lift[:3, 3] == pytest.approx((0.1, -0.3, 0.2))


def test_only_the_touch_topics_of_sensors_that_are_there():
    assert messages.touch_kinds(find_body("H21").touch_sensors) == {
        "bumper": "Bumper",
        "head_touch": "HeadTouch",
    }
    assert "hand_touch" in messages.touch_kinds(H25.touch_sensors)
    assert messages.touch_kinds(CART.touch_sensors) == {}


def test_without_odometry_there_is_no_odom(types):
    floor, _ = BodyFrames(types, H25).floor(5, [0.0] * 26, (0.0, 0.0), None)
    assert [each.child_frame_id for each in floor] == ["base_footprint"]


def test_the_velocity_of_the_odometry_is_that_in_the_robot_s_own_frame(types):
    frames, heading = BodyFrames(types, H25), 2.5
    cosine, sine = math.cos(heading), math.sin(heading)
    for tick in range(20):
        ahead, aside = 0.1 * tick / 50, -0.03 * tick / 50
        x, y = cosine * ahead - sine * aside, sine * ahead + cosine * aside
        fields = frames.odometry(HEADER, tick / 50, np.eye(4), EncodersData(x, y, heading, cosine, sine))
    twist = sent(types, "nav_msgs/msg/Odometry", fields).twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == pytest.approx((0.1, -0.03, 0.0), abs=1e-6)


def test_the_odometry_is_less_certain_after_each_metre(types):
    frames, before = BodyFrames(types, H25), 0.0
    for metres in range(4):
        data = EncodersData(float(metres), 0.0, 0.1 * metres, math.cos(0.1 * metres), math.sin(0.1 * metres))
        message = sent(
            types, "nav_msgs/msg/Odometry", frames.odometry(HEADER, 10.0 * metres, np.eye(4), data)
        )
        pose, twist = (np.reshape(each.covariance, (6, 6)) for each in (message.pose, message.twist))
        assert (np.diag(pose) > 0.0).all()
        assert (np.diag(twist) > 0.0).all()
        assert pose[0, 0] == pose[1, 1] > before
        assert math.sqrt(pose[0, 0]) == pytest.approx(math.hypot(0.01, 0.1 * metres))
        before = pose[0, 0]


def test_a_simulation_that_begins_again_has_no_velocity_from_before(types):
    frames = BodyFrames(types, H25)
    frames.odometry(HEADER, 50.0, np.eye(4), EncodersData(3.0, 0.0, 0.0, 1.0, 0.0))
    fields = frames.odometry(HEADER, 0.02, np.eye(4), EncodersData(0.0, 0.0, 0.0, 1.0, 0.0))
    assert sent(types, "nav_msgs/msg/Odometry", fields).twist.twist.linear.x == 0.0
