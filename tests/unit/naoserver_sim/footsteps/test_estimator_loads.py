"""The loads of the feet, from the torques of the legs."""

import pytest

from naoserver_sim._footsteps.estimator import Estimator, Loads
from tests.support.humanoids import BODIES, Humanoid

pytestmark = pytest.mark.sim

TICK = 0.01


class Rig:
    """A robot that stands, and an estimate of its loads beside its own."""

    def __init__(self, body):
        self.robot = Humanoid(body)
        self.robot.go(1.0)
        robot = self.robot
        self.estimator = Estimator(robot.mj, robot.limbs, robot.footsteps)
        self.loads = Loads(robot.mj, robot.limbs, self.estimator)

    def watch(self, seconds):
        robot, limbs = self.robot, self.robot.limbs
        for _ in range(round(seconds / TICK)):
            robot.go(TICK)
            angles, speeds = robot.data.qpos[limbs.qpos], robot.data.qvel[limbs.dofs]
            self.estimator.turn(TICK, robot.inertial())
            self.estimator.tick(TICK, robot.inertial(), angles, speeds, (0.5, 0.5))
            self.loads.tick(TICK, robot.data.actuator_force[limbs.leg_motors])


@pytest.fixture(params=sorted(BODIES))
def rig(request):
    return Rig(request.param)


def test_the_feet_of_a_standing_robot_share_its_weight(rig):
    rig.watch(1.0)
    assert rig.loads.feet.sum() == pytest.approx(rig.loads.weight, rel=0.1)
    assert rig.loads.shares == pytest.approx((0.5, 0.5), abs=0.1)


def test_the_foot_towards_which_it_is_pushed_bears_more(rig):
    rig.robot.push(0.0, 30.0, 2.0)
    rig.watch(1.5)
    left, right = rig.loads.shares
    assert left > right + 0.2


def test_feet_in_the_air_bear_nothing(rig):
    rig.robot.hang(0.5)
    rig.watch(1.5)
    assert rig.loads.feet.sum() < 0.2 * rig.loads.weight
