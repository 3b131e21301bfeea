"""The battery, compared with the energy that is taken from it."""

import pytest

from naoserver.bodies.nao import H25
from naoserver_sim.robot import SimulatedRobot
from tests.support.present import present
from zenoh_ice.threads.clock import VirtualClock

pytestmark = pytest.mark.sim


@pytest.fixture
def robot():
    return SimulatedRobot(clock=VirtualClock(), skin=False)


def test_what_was_drawn_is_what_is_missing(robot):
    drawn = 0.0
    for _ in range(50):
        robot.clock.advance(0.1)
        drawn -= robot.senses.read().battery.current * present(H25.battery).voltage * 0.1
    assert (1.0 - robot.senses.read().battery.charge) * present(H25.battery).energy == pytest.approx(
        drawn, rel=0.03
    )


def test_standing_it_lasts_for_the_hour_and_a_half_of_the_data_sheet(robot):
    robot.clock.advance(2.0)
    minutes = (
        present(H25.battery).energy
        / -(robot.senses.read().battery.current * present(H25.battery).voltage)
        / 60
    )
    assert minutes == pytest.approx(90, abs=5)


def test_motors_that_hold_take_what_their_windings_lose(robot):
    robot.clock.advance(1.0)
    torques = dict(zip((joint.name for joint in robot.joints), robot.read().torques, strict=True))
    del torques["RHipYawPitch"]  # its motor is that of the other hip
    motors = {joint.name: joint.motor for joint in H25.joints}
    lost = sum(
        torque**2 * present(motors[name]).no_load_speed / present(motors[name]).stall_torque
        for name, torque in torques.items()
    )
    assert lost > 0.5
    assert _watts(robot) == pytest.approx(present(H25.battery).electronics + lost, abs=0.02)


def test_work_takes_more_and_limp_motors_take_nothing(robot):
    robot.clock.advance(1.0)
    standing = _watts(robot)
    robot.command_velocities({"LShoulderPitch": -4.0, "RShoulderPitch": -4.0})
    robot.clock.advance(0.3)
    assert _watts(robot) > standing + 0.5
    robot.command_stiffnesses({joint.name: 0.0 for joint in robot.joints}, 0.0)
    robot.clock.advance(3.0)  # it lies on the floor
    assert _watts(robot) == pytest.approx(present(H25.battery).electronics)
    assert robot.senses.read().battery.temperature > 25.0


def _watts(robot):
    return -robot.senses.read().battery.current * present(H25.battery).voltage
