"""Setpoints between NAOqi's reports."""

import pytest

from naoserver.bodies.nao import H25
from naoserver.naoqi._state import Setpoints

YAW = H25.joint_names.index("HeadYaw")
REST = (0.0,) * 26
STIFF = (1.0,) * 26


@pytest.fixture
def setpoints():
    setpoints = Setpoints(H25.joints)
    setpoints.report(REST, REST, STIFF, 0.0)
    return setpoints


def with_yaw(value):
    return tuple(value if index == YAW else 0.0 for index in range(26))


def test_a_setpoint_moves_from_its_command_on_at_its_speed(setpoints):
    setpoints.send("HeadYaw", 0.5, 1.0, 10.0)
    assert [setpoints.at(time)[YAW] for time in (10.0, 10.2, 10.5, 11.0)] == pytest.approx(
        [0.0, 0.2, 0.5, 0.5]
    )


def test_it_is_on_its_way_until_it_arrives(setpoints):
    assert not setpoints.moving("HeadYaw", 10.0)
    setpoints.send("HeadYaw", 0.5, 1.0, 10.0)
    assert setpoints.moving("HeadYaw", 10.4)
    assert not setpoints.moving("HeadYaw", 10.6)


def test_a_new_command_begins_where_the_setpoint_is(setpoints):
    setpoints.send("HeadYaw", 1.0, 1.0, 10.0)
    setpoints.send("HeadYaw", 0.0, 0.5, 10.4)
    assert setpoints.at(10.6)[YAW] == pytest.approx(0.3)


def test_it_stays_where_it_is_held(setpoints):
    setpoints.send("HeadYaw", 1.0, 1.0, 10.0)
    setpoints.hold("HeadYaw", 10.4)
    assert setpoints.at(20.0)[YAW] == pytest.approx(0.4)


def test_it_goes_no_further_than_its_joint(setpoints):
    setpoints.send("HeadYaw", 99.0, 100.0, 10.0)
    assert setpoints.at(20.0)[YAW] == H25.joints[YAW].upper


def test_a_late_report_does_not_pull_it_back(setpoints):
    setpoints.send("HeadYaw", 1.0, 1.0, 10.0)
    setpoints.report(with_yaw(0.45), with_yaw(0.4), STIFF, 10.5)
    assert setpoints.at(10.5)[YAW] == pytest.approx(0.5)


def test_a_report_of_something_else_is_believed_and_the_way_goes_on(setpoints):
    setpoints.send("HeadYaw", 1.0, 1.0, 10.0)
    setpoints.report(with_yaw(-0.5), with_yaw(-0.5), STIFF, 10.5)
    assert setpoints.at(10.6)[YAW] == pytest.approx(-0.4)


def test_a_report_right_after_a_command_is_of_before(setpoints):
    setpoints.send("HeadYaw", 1.0, 8.0, 10.0)
    setpoints.report(REST, REST, STIFF, 10.1)
    assert setpoints.at(10.1)[YAW] == pytest.approx(0.8)


def test_at_rest_the_report_counts(setpoints):
    setpoints.send("HeadYaw", 0.5, 1.0, 10.0)
    setpoints.report(with_yaw(0.49), with_yaw(0.48), STIFF, 11.0)
    assert setpoints.at(11.0)[YAW] == 0.49


def test_that_of_a_limp_motor_goes_along_with_its_joint(setpoints):
    setpoints.send("HeadYaw", 1.0, 1.0, 10.0)
    setpoints.report(with_yaw(0.5), with_yaw(-0.7), (0.0,) * 26, 10.5)
    assert setpoints.at(10.6)[YAW] == -0.7
