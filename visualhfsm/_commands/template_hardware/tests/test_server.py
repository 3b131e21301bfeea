from contextlib import closing
from time import monotonic, sleep

import pytest
from server import BODY, IDS, make


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


def test_the_first_joint_moves(robot):
    joint = BODY.joints[0]
    target = 0.3 * joint.upper + 0.7 * joint.lower
    robot.command_stiffnesses({joint.name: 1.0}, 0.0)
    robot.command_positions({joint.name: target}, {joint.name: joint.max_velocity})
    until(lambda: abs(robot.read().positions[0] - target) < 0.01)


def test_a_servo_that_does_not_answer_is_lost_and_the_others_go_on(robot):
    last = BODY.joint_names[-1]
    robot.simulated.command(f"lose {IDS[last]}")
    until(lambda: last in robot.read().faults)
    before = robot.read().time
    until(lambda: robot.read().time > before)


def test_each_camera_sees_the_ball(robot):
    for camera in robot.cameras:
        assert robot.capture(camera.name, 320, 240).pixels.std() > 0
