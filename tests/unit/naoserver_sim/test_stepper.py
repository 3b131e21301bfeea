"""The steps of the physics in a control tick."""

import numpy as np
import pytest

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import WalkVelocity
from naoserver_sim.robot import SimulatedRobot
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim


def test_a_robot_that_falls_on_its_arms_stays_whole():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, noise=True, seed=0, body=find_body("T1"))
    clock.advance(1.0)
    assert robot.walker is not None
    robot.walker.command(WalkVelocity(0.2))
    clock.advance(1.0)
    robot.stage.push((300.0, 0.0, 0.0), 0.2)
    fastest = 0.0
    for _ in range(300):
        clock.advance(0.01)
        fastest = max(fastest, np.abs(robot.read().velocities).max())
    assert robot.state().fallen
    assert fastest < 25.0  # rad/s: with a sparse solver that does not converge it becomes 45
    robot.close()
