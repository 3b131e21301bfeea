"""A robot that falls releases its motors, and no other does."""

import math

import pytest

from naoserver.bodies.capabilities import WalkVelocity
from naoserver.bodies.nao import H25
from naoserver_sim._senses.simulated import FALLING_TILT, FallManager
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.present import present
from zenoh_ice.threads.clock import VirtualClock

pytestmark = pytest.mark.sim

TICK = 0.02


@pytest.fixture
def robot():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, world=load_world("empty"))
    clock.advance(1.0)
    return robot


@pytest.mark.parametrize("bearing", [0, 90, 180, 270])
def test_pushed_over_it_is_limp_before_it_lies(robot, bearing):
    angle = math.radians(bearing)
    robot.stage.push((60.0 * math.cos(angle), 60.0 * math.sin(angle), 0.0), 0.1)
    limp_at = math.inf
    for _ in range(300):
        robot.clock.advance(0.01)
        if max(robot.read().stiffnesses) == 0.0:
            limp_at = min(limp_at, robot.state().torso_tilt)
    assert limp_at < math.radians(80)
    assert robot.state().fallen
    assert robot.senses.falls.falls == 1


def test_after_a_fall_the_motors_hold_again_on_command(robot):
    robot.stage.push((60.0, 0.0, 0.0), 0.1)
    robot.clock.advance(3.0)
    assert set(robot.read().stiffnesses) == {0.0}
    robot.command_stiffnesses({joint.name: 1.0 for joint in robot.joints}, 0.5)
    robot.clock.advance(3.0)
    assert set(robot.read().stiffnesses) == {1.0}
    assert robot.senses.falls.falls == 1


def test_walking_and_light_pushes_leave_it_stiff(robot):
    robot.walker.command(WalkVelocity(forward=0.2, turn=0.3))
    for force in ((6.0, 0.0, 0.0), (0.0, 6.0, 0.0), (-6.0, 0.0, 0.0)):
        robot.clock.advance(2.0)
        robot.read()
        robot.stage.push(force, 0.1)
    robot.clock.advance(2.0)
    assert set(robot.read().stiffnesses) == {1.0}
    assert not robot.state().fallen


class Watched:
    """A fall manager that is shown tilts and loads."""

    def __init__(self):
        self.let_go: list[float] = []
        self.manager = FallManager(present(H25.falls), self.let_go.append)
        self.tilt = 0.0

    def stand(self, seconds=1.0):
        self.tilt = 0.1
        self.look(seconds, load=50.0)

    def look(self, seconds, load, rate=0.0):
        for _ in range(round(seconds / TICK)):
            self.tilt += rate * TICK
            self.manager.check(0.0, TICK, self.tilt, load)


def test_bending_down_slowly_is_no_fall():
    watched = Watched()
    watched.stand()
    watched.look(3.0, load=50.0, rate=0.5)
    assert not watched.let_go


def test_a_quick_bow_is_no_fall():
    watched = Watched()
    watched.stand()
    watched.look(0.2, load=50.0, rate=2.0)
    assert watched.tilt < FALLING_TILT
    assert not watched.let_go


def test_one_fall_is_one_fall_until_it_stands_again():
    watched = Watched()
    for falls in (1, 2):
        watched.stand()
        watched.look(0.6, load=50.0, rate=2.0)
        watched.look(2.0, load=0.0)
        watched.tilt = 0.0
        watched.look(0.6, load=10.0, rate=2.0)  # it rolls about
        assert len(watched.let_go) == watched.manager.falls == falls


def test_lifted_off_its_feet_it_may_be_turned():
    watched = Watched()
    watched.stand()
    watched.look(1.0, load=0.0)
    watched.look(0.6, load=0.0, rate=2.0)
    assert not watched.let_go
