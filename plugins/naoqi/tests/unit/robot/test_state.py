"""Setpoints between NAOqi's reports."""

import pytest

from naoserver.bodies.nao import H25
from naoserver.hardware.connection import HardwareLimits
from plugins.naoqi.tests.support.scripted import ScriptedNaoqi
from visualhfsm_naoqi.robot._state import NaoqiState, Setpoints
from zenoh_ice.threads.clock import VirtualClock

YAW = H25.joint_names.index("HeadYaw")
REST = (0.0,) * 26
STIFF = (1.0,) * 26


@pytest.fixture
def setpoints():
    setpoints = Setpoints(H25.joints)
    setpoints.report(REST, REST, STIFF, 0.0, 0.0)
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
    setpoints.report(with_yaw(0.45), with_yaw(0.4), STIFF, 10.5, 10.5)
    assert setpoints.at(10.5)[YAW] == pytest.approx(0.5)


def test_a_report_of_something_else_is_believed_and_the_way_goes_on(setpoints):
    setpoints.send("HeadYaw", 1.0, 1.0, 10.0)
    setpoints.report(with_yaw(-0.5), with_yaw(-0.5), STIFF, 10.5, 10.5)
    assert setpoints.at(10.6)[YAW] == pytest.approx(-0.4)


def test_a_report_that_came_late_is_of_any_time_since_it_was_asked_for(setpoints):
    setpoints.send("HeadYaw", 1.0, 1.0, 10.0)
    for reported in (0.3, 0.7):
        setpoints.report(with_yaw(reported), with_yaw(reported), STIFF, 10.3, 10.9)
        assert setpoints.at(10.9)[YAW] == pytest.approx(0.9)


def test_a_report_that_was_asked_for_before_it_arrived_does_not_take_it_away(setpoints):
    setpoints.send("HeadYaw", 0.5, 1.0, 10.0)
    setpoints.report(with_yaw(0.4), with_yaw(0.4), STIFF, 10.4, 11.4)
    assert setpoints.at(11.4)[YAW] == 0.5


def test_a_report_right_after_a_command_is_of_before(setpoints):
    setpoints.send("HeadYaw", 1.0, 8.0, 10.0)
    setpoints.report(REST, REST, STIFF, 10.1, 10.1)
    assert setpoints.at(10.1)[YAW] == pytest.approx(0.8)


def test_at_rest_the_report_counts(setpoints):
    setpoints.send("HeadYaw", 0.5, 1.0, 10.0)
    setpoints.report(with_yaw(0.49), with_yaw(0.48), STIFF, 11.0, 11.0)
    assert setpoints.at(11.0)[YAW] == 0.49


def test_that_of_a_limp_motor_goes_along_with_its_joint(setpoints):
    setpoints.send("HeadYaw", 1.0, 1.0, 10.0)
    setpoints.report(with_yaw(0.5), with_yaw(-0.7), (0.0,) * 26, 10.5, 10.5)
    assert setpoints.at(10.6)[YAW] == -0.7


def test_that_of_a_limp_motor_heeds_no_command_until_it_is_stiff(setpoints):
    setpoints.report(REST, REST, (0.0,) * 26, 9.9, 9.9)
    assert setpoints.send("HeadYaw", 1.0, 1.0, 10.0)
    assert setpoints.at(10.5)[YAW] == 0.0
    setpoints.report(REST, REST, STIFF, 11.0, 11.0)
    setpoints.send("HeadYaw", 1.0, 1.0, 11.0)
    assert setpoints.at(11.5)[YAW] == 0.5


class Interrupted(VirtualClock):
    """A clock at which something else happens, right after it was read."""

    def __init__(self):
        super().__init__()
        self.meanwhile = lambda: None

    def now(self):
        moment, meanwhile = super().now(), self.meanwhile
        self.meanwhile = lambda: None
        meanwhile()
        return moment


def test_the_time_of_a_reading_is_not_after_that_of_its_setpoints():
    clock, link = Interrupted(), ScriptedNaoqi().connect(0.0)
    state = NaoqiState(clock, H25, HardwareLimits())
    state.open(link)
    state.tick(link)
    start = state.joints().commands[YAW]

    def measure():
        clock.advance(0.05)
        state.tick(link)

    state.send({"HeadYaw": (1.0, 0.5)})
    clock.advance(0.1)
    clock.meanwhile = measure
    reading = state.joints()
    assert reading.time <= (reading.commands[YAW] - start) / 0.5
    assert state.joints().time > reading.time
