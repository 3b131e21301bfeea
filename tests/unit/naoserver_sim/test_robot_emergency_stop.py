"""The emergency stop of a moving simulated robot: it stops and keeps standing."""

import pytest

pytest.importorskip("mujoco", reason="the simulated robot needs MuJoCo: pip install 'visualhfsm[sim]'")

from naoserver.errors import CommandRefused
from naoserver.moves.walk import WalkGuard
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.present import present
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim


def test_a_robot_that_walks_and_looks_around_stands_after_the_stop():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, world=load_world("empty"))
    assembly = Assembly(robot, ServerOptions(), clock)
    walk = next(each for each in assembly.watched if isinstance(each, WalkGuard))

    def live(seconds, renew=lambda: None):
        for _ in range(round(seconds / 0.1)):
            renew()
            for watched in assembly.watched:
                watched.watch()
            clock.advance(0.1)

    live(0.5)
    assembly.body.move({"HeadYaw": 1.5}, {"HeadYaw": 0.2}, client="a")
    live(3.0, renew=lambda: walk.drive({"forward": 0.25}, "a"))
    assert present(robot.walker).walking
    before = present(robot.walker).odometry()
    assembly.gate.stop("enough")
    live(3.0)
    with pytest.raises(CommandRefused):
        walk.drive({"forward": 0.25}, "a")
    assert not present(robot.walker).walking
    assert not robot.state().fallen
    after = present(robot.walker).odometry()
    assert abs(after.x - before.x) < 0.3
    reading = robot.read()
    assert abs(reading.positions[0]) < 1.0
    assert max(map(abs, reading.velocities)) < 0.05
    assert before.x > 0.3
