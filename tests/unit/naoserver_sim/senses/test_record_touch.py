"""The bumpers with obstacles at a toe, and sensors that are pressed."""

import mujoco
import numpy as np
import pytest

from naoserver.bodies.nao import H25
from naoserver.errors import InvalidCommand
from naoserver_sim._senses.record import SensorRecord
from naoserver_sim.robot import SimulatedRobot
from tests.support.physics import loose_parts
from zenoh_ice.threads.clock import VirtualClock

pytestmark = pytest.mark.sim

TOE = 0.0994
"""Where the foot of the test ends in front of its ankle in m."""


def bumped(*blocks, speed=0.3):
    """Return the bumpers that are pressed within 0.3 s while both feet slide forwards."""
    mj = loose_parts(*blocks).compile()
    data = mujoco.MjData(mj)
    record = SensorRecord(mj, H25, data)
    mujoco.mj_step(mj, data, nstep=40)
    data.qvel[[0, 6]] = speed
    pressed: set[str] = set()
    for _ in range(120):
        mujoco.mj_step(mj, data)
        record.sample(data.time)
        forces = record.felt(record.newest)
        pressed.update(name for name, force in forces.items() if force >= 1.0)
    return pressed


def block(ahead, left, width, height=0.1):
    """Return a block in front of the ankles."""
    return np.array([TOE + ahead + 0.05, left, height / 2]), np.array([0.05, width / 2, height / 2])


def test_what_a_toe_runs_into_presses_its_bumpers():
    assert bumped(block(0.001, left=0.0, width=1.0)) == {name for name in H25.touch if "Bumper" in name}


def test_a_narrow_block_presses_one():
    assert bumped(block(0.001, left=0.14, width=0.03)) == {"LFootBumperLeft"}
    assert bumped(block(0.001, left=-0.14, width=0.03)) == {"RFootBumperRight"}


def test_standing_and_sliding_on_the_floor_presses_none():
    assert bumped() == set()


def test_a_block_behind_or_beside_presses_none():
    beside = np.array([0.02, 0.1 + 0.044 + 0.02, 0.05]), np.array([0.05, 0.0201, 0.05])
    behind = np.array([-0.0506 - 0.02, -0.1, 0.05]), np.array([0.02, 0.05, 0.05])
    assert bumped(beside, behind, speed=-0.05) == set()


@pytest.fixture(scope="module")
def robot():
    return SimulatedRobot(clock=VirtualClock(), skin=False)


def test_a_pressed_sensor_is_reported_for_as_long_as_it_is_pressed(robot):
    robot.senses.press("HeadMiddle", 0.5)
    robot.senses.press("ChestButton", 1.0)
    assert robot.senses.read().touched == {"HeadMiddle", "ChestButton"}
    robot.clock.advance(0.4)
    assert robot.senses.read().touched == {"HeadMiddle", "ChestButton"}
    robot.clock.advance(0.2)
    assert robot.senses.read().touched == {"ChestButton"}
    robot.clock.advance(0.6)
    assert robot.senses.read().touched == set()


def test_who_presses_a_sensor_again_does_not_let_go_of_it_sooner(robot):
    robot.senses.press("HeadRear", 0.5)
    robot.clock.advance(0.1)
    robot.senses.press("HeadRear", 0.1)
    robot.clock.advance(0.3)
    assert robot.senses.read().touched == {"HeadRear"}
    robot.clock.advance(0.2)
    assert robot.senses.read().touched == set()


def test_every_named_sensor_can_be_pressed_and_no_other(robot):
    for name in robot.senses.touch_names:
        robot.senses.press(name, 0.1)
    assert robot.senses.read().touched == set(robot.senses.touch_names) == set(H25.touch_sensors)
    with pytest.raises(InvalidCommand, match=r"HeadLeft.*HeadFront"):
        robot.senses.press("HeadLeft", 0.1)
