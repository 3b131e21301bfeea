"""The delay and the backlash of the gears between motors and joints."""

import math
from contextlib import closing

import numpy as np
import pytest

from naoserver.bodies.parts import Play
from naoserver_sim._motors import PLAY, Gears
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

TICK = 0.01
DEGREE = math.radians(1.0)


def gears(backlash=DEGREE, delay=2, joints=2):
    """Return gears of two joints, and of a ball's motor behind them, all commanded to 0."""
    noise = Play(delay=delay, least_backlash=backlash, most_backlash=backlash)
    return Gears(noise, np.zeros(3), joints, np.random.default_rng(1))


def served(commands, positions, of):
    """Return the commands that the servos get."""
    out = np.full(3, math.nan)
    of.tick(np.array(commands), np.array(positions), out)
    return out.tolist()


def test_a_command_reaches_its_motor_ticks_later_and_a_balls_at_once():
    late = gears(backlash=0.0)
    assert served([0.3, 0.0, 0.3], [0.0, 0.0, 0.0], late) == [0.0, 0.0, 0.3]
    assert served([0.3, 0.0, 0.3], [0.0, 0.0, 0.0], late) == [0.0, 0.0, 0.3]
    assert served([0.5, 0.0, 0.3], [0.0, 0.0, 0.0], late) == [0.3, 0.0, 0.3]


@pytest.mark.parametrize(
    ("position", "error"), [(0.0, 0.0), (0.4, 0.0), (-0.5, 0.0), (0.7, -0.2), (-0.7, 0.2)]
)
def test_no_force_acts_within_half_the_backlash_on_either_side(position, error):
    out = served([0.0] * 3, [position * DEGREE, 0.0, 0.0], gears())
    assert out[0] - position * DEGREE == pytest.approx(error * DEGREE)


def test_who_is_put_somewhere_was_commanded_to_be_there():
    late = gears(backlash=0.0)
    late.settle(np.array([1, 2]), np.array([0.7, 0.8]))
    assert served([0.1, 0.7, 0.8], [0.0] * 3, late) == [0.0, 0.7, 0.8]


def backlash(seed):
    return Gears(PLAY, np.zeros(40), 25, np.random.default_rng(seed)).backlash


def test_each_joint_of_each_robot_has_its_own_backlash():
    drawn = np.degrees(backlash(1))
    assert drawn == pytest.approx(np.degrees(backlash(1)))
    assert drawn != pytest.approx(np.degrees(backlash(2)))
    assert 0.5 <= drawn.min() < 0.8
    assert 1.7 < drawn.max() <= 2.0


class Rig:
    """A robot that stands in a posture."""

    def __init__(self, *, noise, posture="StandInit", **options):
        self.clock = VirtualClock()
        self.robot = SimulatedRobot(
            clock=self.clock,
            skin=False,
            world=load_world("empty"),
            noise=noise,
            seed=1,
            posture=posture,
            **options,
        )
        self.clock.advance(0.5)

    def angle(self, joint):
        reading = self.robot.read()
        names = [each.name for each in self.robot.joints]
        return reading.positions[names.index(joint)]


@pytest.mark.parametrize(("noise", "ticks"), [(False, 1), (True, 3)])
def test_a_joint_moves_30_ms_after_its_command_with_noise(noise, ticks):
    rig = Rig(noise=noise)
    with closing(rig.robot):
        begin = rig.angle("LElbowRoll")
        rig.robot.command_positions({"LElbowRoll": -1.2}, {"LElbowRoll": 5.0})
        moved = 0
        while abs(rig.angle("LElbowRoll") - begin) < 0.01:
            rig.clock.advance(TICK)
            moved += 1
    assert ticks <= moved <= ticks + 1


def test_a_load_that_reverses_leans_a_joint_against_the_other_side():
    """Push the torso forwards and backwards: the ankles give way by the backlash, too."""
    swings = []
    for noise in (False, True):
        rig = Rig(noise=noise)
        with closing(rig.robot):
            angles = []
            for force in (6.0, -6.0):
                rig.robot.stage.push((force, 0.0, 0.0), 0.4)
                rig.clock.advance(0.4)
                angles.append(rig.angle("LAnklePitch"))
        swings.append(abs(angles[0] - angles[1]))
    assert swings[1] - swings[0] > 0.2 * DEGREE


def test_a_reset_robot_holds_its_start_although_its_last_commands_are_on_their_way():
    rig = Rig(noise=True)
    with closing(rig.robot):
        there = rig.angle("HeadYaw")
        rig.robot.command_positions({"HeadYaw": 1.5}, {"HeadYaw": 8.0})
        rig.clock.advance(0.2)
        rig.robot.stage.reset()
        for _ in range(5):
            rig.clock.advance(TICK)
            assert abs(rig.angle("HeadYaw") - there) < 2 * DEGREE
