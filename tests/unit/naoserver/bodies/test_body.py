"""The facts of the H25 in the code."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.nao import H25
from naoserver.bodies.parts import Axis, RangeTable
from naoserver.body import read_body, write_body
from naoserver.errors import RobotError
from tests.support.linkage import LINKAGE
from tests.support.published import TOTAL_MASS

VERTICAL_VIEW = 43.7
"""Of the cameras in degrees, from the data sheet."""
HEAD = next(table for table in H25.tables if table.dependent == "HeadPitch")


def test_the_body_is_whole():
    assert len(H25.joints) == 26
    assert H25.mass == pytest.approx(TOTAL_MASS, abs=1e-5)
    assert {joint.child for joint in H25.joints} == {link.name for link in H25.links} - {"torso"}


def test_every_joint_belongs_to_one_hinge():
    named = [axis.joint for axes in H25.hinges.values() for axis in axes.values()]
    assert sorted(named) == sorted(H25.joint_names)


def test_a_hinge_is_found_by_its_name():
    wrist = H25.hinge("LeftWrist")
    assert wrist is not None
    assert (wrist.name, wrist.joints) == ("LeftWrist", ("LWristYaw",))
    assert H25.hinge("Tail") is None
    assert H25.neck is not None
    assert set(H25.neck.axes) == {Axis.PAN, Axis.TILT}


def test_a_motor_takes_the_power_that_it_gives():
    torques = [(-1.0) ** index * index for index in range(len(H25.joints))]
    currents = H25.motor_currents(torques)
    assert H25.battery is not None
    for joint, torque, current in zip(H25.joints, torques, currents, strict=True):
        assert joint.motor is not None
        power = abs(torque) * joint.motor.no_load_speed
        assert current * H25.battery.voltage == pytest.approx(power), joint.name
    with pytest.raises(ValueError, match="argument 2"):
        H25.motor_currents(torques[:-1])


@pytest.mark.parametrize("name", BODY_NAMES)
def test_a_body_is_written_as_it_is_read(name):
    body = find_body(name)
    text = write_body(body)
    assert read_body(text, "body.json").as_data() == body.as_data()
    assert "Infinity" not in text
    assert "looks" not in body.as_data()


def test_postures_are_within_the_ranges():
    limits = {joint.name: joint for joint in H25.joints}
    for name in ("Stand", "StandInit", "Crouch"):
        for joint, angle in H25.postures[name].angles.items():
            assert limits[joint].lower - 0.01 <= angle <= limits[joint].upper + 0.01, (name, joint)


def test_a_camera_has_a_rate_for_each_size():
    for camera in H25.cameras:
        assert len(camera.sizes) == len(camera.rates)
        assert (320, 240) in camera.sizes
        vertical = 2 * math.atan(math.tan(camera.horizontal_fov / 2) * 0.75)
        assert math.degrees(vertical) == pytest.approx(VERTICAL_VIEW, abs=0.1)


def test_a_body_without_some_joints_has_them_fixed_and_all_else_as_it_was():
    less = H25.without("less", "Less", ("LHand", "RWristYaw"), ("LHandBack",))
    assert (less.name, less.title) == ("less", "Less")
    assert [joint.name for joint in less.fixed_joints] == ["LHand", "RWristYaw"]
    assert less.joints == tuple(joint for joint in H25.joints if joint not in less.fixed_joints)
    assert less.links == H25.links
    for name, posture in H25.postures.items():
        assert less.postures[name].angles == {
            joint: angle for joint, angle in posture.angles.items() if joint in less.joint_names
        }
    assert less.touch_sensors == tuple(each for each in H25.touch_sensors if each != "LHandBack")
    assert H25.fixed_joints == ()


def test_a_body_without_an_arm_has_nothing_that_it_would_move():
    arm = H25.groups.left_arm
    less = H25.without("less", "Less", arm, ())
    assert less.groups == replace(H25.groups, left_arm=())
    (rule,), (whole,) = less.speed_rules, H25.speed_rules
    assert rule == replace(whole, slower=tuple(joint for joint in whole.slower if joint not in arm))
    assert rule.slower[0] == "RShoulderPitch"
    assert H25.hinges.keys() - less.hinges.keys() == {"LeftShoulder", "LeftElbow", "LeftWrist", "LeftHand"}


@pytest.mark.parametrize(("angles", "wrong"), [((0.0, 0.0, 1.0), 0.0), ((0.0, 2.0, 1.0), 1.0)])
def test_a_table_whose_angles_do_not_increase_is_refused_with_the_angle(angles, wrong):
    with pytest.raises(RobotError, match=f"range table of HeadPitch: angle {wrong} does not increase"):
        RangeTable("HeadYaw", "HeadPitch", tuple((angle, -1.0, 1.5) for angle in angles))


def test_the_head_table_interpolates_and_ends_at_its_edges():
    assert HEAD.at(0.0) == (-0.671951, 0.515047)
    assert HEAD.at(-3.0) == HEAD.rows[0][1:]
    assert HEAD.at(3.0) == HEAD.rows[-1][1:]
    (a, low_a, high_a), (b, low_b, high_b) = HEAD.rows[0:2]
    assert HEAD.at((a + b) / 2) == pytest.approx(((low_a + low_b) / 2, (high_a + high_b) / 2))


def test_a_range_over_a_sweep_is_the_narrowest_on_the_way():
    table = RangeTable("HeadYaw", "HeadPitch", ((-1.0, -2.0, 2.0), (0.5, -0.1, 0.2), (1.0, -2.0, 2.0)))
    assert table.over((1.0, -1.0)) == (-0.1, 0.2)
    assert table.over((-1.0, 0.0)) == table.at(0.0)


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=3), st.floats(0, 1))
def test_a_range_over_a_sweep_holds_everywhere_in_it(angles, share):
    lower, upper = HEAD.over(angles)
    between = min(angles) + share * (max(angles) - min(angles))
    low, high = HEAD.at(between)
    assert lower >= low - 1e-9
    assert upper <= high + 1e-9


@pytest.mark.parametrize(
    ("rows", "reason"),
    [((), "no rows"), (((0, 0, 1), (0, 0, 1)), "does not increase"), (((0, 1, 0),), "empty range")],
)
def test_a_table_that_makes_no_sense_is_refused(rows, reason):
    with pytest.raises(RobotError, match=f"HeadPitch.*{reason}"):
        RangeTable("HeadYaw", "HeadPitch", rows)


def test_a_joint_of_which_nothing_is_said_is_as_near_to_0_as_can_be():
    angles = H25.complete({"HeadYaw": 0.5, "HeadPitch": 9.0})
    assert (angles["HeadYaw"], angles["HeadPitch"]) == (0.5, H25.joint["HeadPitch"].upper)
    assert (angles["LShoulderPitch"], angles["LElbowRoll"]) == (0.0, H25.joint["LElbowRoll"].upper)


def test_a_follower_is_where_its_leader_takes_it():
    assert LINKAGE.complete({"grip": 0.4, "pinch": 0.0})["pinch"] == pytest.approx(0.1 - 2.0 * 0.4)
