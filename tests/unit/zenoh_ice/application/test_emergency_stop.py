"""When the stop of a robot is over."""

import math

import pytest

from tests.support.limits import FOREVER
from zenoh_ice.application.emergency_stop import RobotStop


@pytest.fixture
def stop():
    """A stop that the robot has confirmed."""
    stop = RobotStop()
    stop.confirm()
    return stop


def test_it_is_over_once_the_robot_is_still(stop):
    stop.observe([0.0, -0.4], "", FOREVER, answered=True)
    assert (stop.over, stop.moving, stop.speed) == (False, True, 0.4)
    stop.observe([0.0, -0.05], "", FOREVER, answered=True)
    assert (stop.over, stop.still) == (True, True)


def test_it_is_not_over_before_the_robot_has_confirmed_it():
    stop = RobotStop()
    stop.observe([0.0], "", 0.0, answered=True)
    assert (stop.over, stop.still) == (False, False)


def test_it_is_not_over_while_no_command_reaches_the_robot(stop):
    stop.observe([0.0], "the cable is out", FOREVER, answered=True)
    assert (stop.over, stop.still) == (False, False)
    stop.observe(None, "", FOREVER, answered=True)
    assert (stop.over, stop.still) == (True, True)


def test_half_an_answer_says_nothing(stop):
    stop.observe([0.4], None, FOREVER, answered=False)
    assert (stop.over, stop.speed) == (False, None)
    stop.observe([0.0], None, FOREVER, answered=False)
    assert not stop.over


def test_the_last_observation_ends_it_though_the_robot_moves(stop):
    stop.observe([0.4], None, 0.0, answered=False)
    assert (stop.over, stop.still, stop.speed) == (True, False, 0.4)


@pytest.mark.parametrize("velocities", [None, [], [math.nan]])
def test_a_robot_that_says_nothing_of_its_joints_counts_as_still(stop, velocities):
    stop.observe(velocities, None, FOREVER, answered=True)
    assert (stop.over, stop.still, stop.speed) == (True, True, None)


def test_an_unknown_velocity_hides_no_known_one(stop):
    stop.observe([math.nan, 0.4], None, FOREVER, answered=True)
    assert (stop.over, stop.speed) == (False, 0.4)
