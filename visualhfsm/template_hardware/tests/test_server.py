from contextlib import closing
from time import monotonic, sleep

import pytest
from server import make


@pytest.fixture
def robot():
    with closing(make()) as robot:
        robot.start()
        yield robot


def until(condition):
    end = monotonic() + 20.0
    while not condition():
        assert monotonic() < end
        sleep(0.01)


def test_the_head_turns(robot):
    robot.command_stiffnesses({"pan": 1.0}, 0.0)
    robot.command_positions({"pan": 0.5}, {"pan": 2.0})
    until(lambda: abs(robot.read().positions[0] - 0.5) < 0.01)


def test_a_servo_that_does_not_answer_is_lost_and_the_others_go_on(robot):
    robot.simulated.command("lose 4")
    until(lambda: "elbow" in robot.read().faults)
    before = robot.read().time
    until(lambda: robot.read().time > before)


def test_it_sees_the_ball(robot):
    assert robot.capture("Camera", 320, 240).pixels.std() > 0
