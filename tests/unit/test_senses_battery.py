"""The battery against the energy that is taken from it."""

import numpy as np
import pytest

from naoserver.body import H25
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.senses.battery import ENERGY, VOLTAGE
from zenoh_ice.clock import VirtualClock

pytestmark = pytest.mark.sim


@pytest.fixture
def robot():
    return SimulatedRobot(clock=VirtualClock(), skin=False)


def test_what_was_drawn_is_what_is_missing(robot):
    drawn = 0.0
    for _ in range(50):
        robot.clock.advance(0.1)
        drawn -= robot.senses.read().battery.current * VOLTAGE * 0.1
    assert (1.0 - robot.senses.read().battery.charge) * ENERGY == pytest.approx(drawn, rel=0.03)


def test_standing_it_lasts_for_the_hour_and_a_half_of_the_data_sheet(robot):
    robot.clock.advance(2.0)
    minutes = ENERGY / -(robot.senses.read().battery.current * VOLTAGE) / 60
    assert minutes == pytest.approx(90, abs=5)


def test_work_takes_more(robot):
    robot.clock.advance(1.0)
    before = robot.senses.read().battery
    motors = {joint["name"]: joint["motor"] for joint in H25.facts["joints"]}
    robot.command_stiffnesses(dict.fromkeys(motors, 0.0), 0.0)
    robot.clock.advance(3.0)  # it lies on the floor, limp
    limp = robot.senses.read().battery
    assert limp.current > before.current
    assert not limp.plugged
    assert limp.temperature > 25.0
    forces = dict(zip(motors, robot.read().torques, strict=True))
    lost = sum(
        forces[name] ** 2 * motor["no_load_speed_out"] / motor["stall_torque_out_no_loss"]
        for name, motor in motors.items()
    )
    assert -limp.current * VOLTAGE == pytest.approx(40.0 + lost, abs=0.5)
    assert np.isfinite(limp.temperature)
