"""Programs that move legs and torso, in the order of calls of NAOqi's documentation: the simulated robot stands.

The first two are almotion_wbFootState.py and almotion_cartesianFoot.py of NAOqi 2.1, the third
almotion_wbEnableBalanceConstraint.py, in which a real Nao falls without whole body control.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("qi")

from naoserver.bodies.kinematics import matrix_of
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from plugins.naoqi.tests.support.rig import Rig
from tests.support.leg_motions import KICK
from tests.support.soak import cases
from visualhfsm_naoqi.programs._effectors import EffectorMotion
from visualhfsm_naoqi.programs._whole_body import WholeBody

pytestmark = pytest.mark.slow

ROBOT = 2
ALL, POSITION = 63, 7
UPRIGHT = math.radians(30)
"""Largest tilt of the torso, except where the program itself tilts it so far."""
BACK = [0.0] * 6
KNEES = ["LKneePitch", "RKneePitch"]
LEG = ["RHipPitch", "RKneePitch", "RAnklePitch"]


def rad(*degrees):
    return [math.radians(angle) for angle in degrees]


class Program:
    """A program of a simulated robot in StandInit, and what it sees."""

    def __init__(self, *, noise=False):
        world = load_world("empty")
        self.rig = Rig(
            lambda clock: SimulatedRobot(clock=clock, world=world, skin=False, noise=noise, seed=3)
        )
        self.motion = self.rig.motion
        self.body = self.rig.access.service(WholeBody)
        self.effectors = self.rig.access.service(EffectorMotion)
        self.tilt = 0.0
        self.wait(0.5)

    def wait(self, seconds):
        for _ in range(round(seconds / 0.02)):
            self.rig.advance(0.02)
            self.tilt = max(self.tilt, self.rig.robot.state().torso_tilt)

    def call(self, operation, *arguments):
        """Perform a long call."""
        call = self.rig.begin(operation, *arguments)
        while not call.ended:
            self.wait(0.02)
        call.join()
        assert call.error is None
        return call.result

    def keep(self, state, balanced="Legs"):
        """Enable whole body control with both feet in a state."""
        self.body.wbEnable(True)
        self.body.wbFootState(state, "Legs")
        self.body.wbEnableBalanceConstraint(True, balanced)

    def bend(self, names, angles, times):
        self.call(self.motion.angleInterpolation, names, angles, times, True)

    def go(self, names, paths, masks, times):
        """Move effectors along paths relative to where they are."""
        self.call(self.effectors.positionInterpolations, names, ROBOT, paths, masks, times, False)

    def shift(self, name, change, seconds):
        """Move an effector by a change in its own frame."""
        place = np.array(self.motion.getTransform(name, 1, False)).reshape(4, 4) @ matrix_of(change)
        self.call(self.effectors.transformInterpolations, name, 1, place.ravel().tolist(), ALL, seconds, True)


def turn_the_feet_in_a_plane(program):
    program.keep("Plane")
    program.bend("LHipYawPitch", rad(-45, 10, 0), [3.0, 6.0, 9.0])
    assert program.rig.positions("LHipYawPitch") == pytest.approx([0.0], abs=0.1)


def put_a_foot_aside_and_turn_it(program):
    program.shift("Torso", [0.0, -0.06, -0.03, 0.0, 0.0, 0.0], 2.0)
    left, right = (program.motion.getPosition(leg, ROBOT, True) for leg in ("LLeg", "RLeg"))
    before = math.dist(left[:2], right[:2])
    program.shift("LLeg", [0.0, 0.04, 0.0, 0.0, 0.0, math.pi / 4], 2.0)
    program.wait(0.5)
    left, right = (program.motion.getPosition(leg, ROBOT, True) for leg in ("LLeg", "RLeg"))
    assert math.dist(left[:2], right[:2]) - before == pytest.approx(0.04, abs=0.015)
    assert left[5] - right[5] == pytest.approx(math.pi / 4, abs=0.12)


def bend_the_knees(program):
    program.keep("Fixed")
    program.bend(KNEES, [rad(0, 40)] * 2, [[5.0, 10.0]] * 2)
    assert program.rig.positions(*KNEES) == pytest.approx(rad(40, 40), abs=0.05)


def bend_the_knees_far_and_fast(program):
    program.keep("Fixed")
    for angle in (100, 5):
        program.motion.setAngles(KNEES, rad(angle, angle), 0.3)
        program.wait(2.0)


def bend_one_knee(program):
    program.keep("Fixed")
    program.bend(KNEES[0], rad(70, 40), [2.0, 4.0])


def bend_the_hips(program):
    program.keep("Fixed")
    program.bend(["LHipPitch", "RHipPitch"], [rad(-60, -25)] * 2, [[3.0, 6.0]] * 2)


def bend_the_ankles(program):
    program.keep("Fixed")
    program.bend(["LAnklePitch", "RAnklePitch"], [rad(20, -20)] * 2, [[2.0, 4.0]] * 2)


def spread_the_hips(program):
    program.keep("Fixed")
    program.bend(["LHipRoll", "RHipRoll"], [rad(15), rad(-15)], [[2.0]] * 2)


def kick_without_freeing_the_foot(program):
    program.keep("Fixed")
    program.call(program.motion.angleInterpolation, *KICK)


def turn_fixed_feet(program):
    program.keep("Fixed")
    program.bend("LHipYawPitch", rad(-45, 10, 0), [3.0, 6.0, 9.0])


def turn_the_feet_at_once(program):
    program.keep("Plane")
    for angle in (-45, 10):
        program.motion.setAngles("LHipYawPitch", rad(angle)[0], 0.1)
        program.wait(3.0)


def turn_the_feet_inwards(program):
    program.keep("Plane")
    program.bend("LHipYawPitch", rad(25, 0), [2.0, 4.0])


def turn_the_feet_over_one_of_them(program):
    program.keep("Plane")
    program.call(program.body.wbGoToBalance, "RLeg", 2.0)
    program.bend("LHipYawPitch", rad(-45, 10, 0), [3.0, 6.0, 9.0])


def turn_a_free_hip(program):
    program.keep("Fixed")
    program.call(program.body.wbGoToBalance, "LLeg", 2.0)
    program.body.wbFootState("Free", "RLeg")
    program.bend("RHipYawPitch", rad(-30, 0), [2.0, 4.0])


def lift_a_free_leg(program):
    program.keep("Fixed")
    program.call(program.body.wbGoToBalance, "LLeg", 2.0)
    program.body.wbFootState("Free", "RLeg")
    program.bend(LEG, [rad(-40, -25), rad(80, 40), rad(-40, -20)], [[1.5, 3.0]] * 3)


def lift_a_free_foot(program):
    program.keep("Fixed")
    program.call(program.body.wbGoToBalance, "RLeg", 2.0)
    program.body.wbFootState("Free", "LLeg")
    program.go("LLeg", [[0.0, 0.0, 0.04, 0.0, 0.0, 0.0], BACK], ALL, [2.0, 4.0])


def balance_over_each_foot(program):
    program.keep("Fixed")
    for leg in ("LLeg", "RLeg", "Legs"):
        assert program.call(program.body.wbGoToBalance, leg, 2.0)


def swing_the_hips(program):
    program.keep("Fixed")
    round_ = [[0.03, 0, 0, 0, -0.14, 0], [0, -0.03, 0, -0.14, 0, 0]]
    round_ += [[-0.03, 0, 0, 0, 0.14, 0], [0, 0.03, 0, 0.14, 0, 0]]
    program.go("Torso", [*round_, *round_, BACK], ALL, [1.0 + count for count in range(9)])


def move_torso_and_arm(program):
    torso, arm = [[0.04, 0, 0, 0, 0, 0], [0, 0, -0.04, 0, 0, 0], BACK], [[0, -0.06, 0, 0, 0, 0], BACK]
    program.go(["Torso", "LArm"], [torso, arm], [ALL, POSITION], [[1.0, 2.0, 3.0], [1.5, 3.0]])


def reach_too_far_with_both_arms(program):
    program.keep("Fixed")
    far = [[[0.4, side * 0.2, -0.2, 0, 0, 0]] for side in (1, -1)]
    names, torso = ["Torso", "LArm", "RArm"], [[0, 0, -0.02, 0, 0, 0]]
    program.go(names, [torso, *far], [ALL, POSITION, POSITION], [[2.0]] * 3)


def control_an_arm(program):
    program.keep("Fixed")
    program.body.wbEnableEffectorControl("LArm", True)
    for place in ([0.3, 0.2, 0.2], [0.1, 0.4, 0.5], [0.4, 0.1, 0.05]):
        program.body.wbSetEffectorControl("LArm", place)
        program.wait(2.0)


def send_the_torso(program):
    x, y, z, *turns = program.motion.getPosition("Torso", ROBOT, False)
    program.effectors.setPosition("Torso", ROBOT, [x, y - 0.06, z - 0.03, *turns], 0.3, ALL)
    program.wait(3.0)


def shifted(name, *change):
    """Return the program that moves torso or foot away and back."""

    def run(program):
        program.go(name, [list(change), BACK], ALL, [2.0, 4.0])

    run.__name__ = f"shift {name} {change}"
    return run


SHIFTS = [
    *(("Torso", *change) for change in ([0, -0.15, 0, 0, 0, 0], [0.08, 0, 0, 0, 0, 0], [-0.08, 0, 0, 0, 0, 0])),
    *(("Torso", *change) for change in ([0, 0, -0.15, 0, 0, 0], [0, 0, 0, 0, 0, 0.4], [0, 0, 0, 0.3, 0, 0])),
    *(("LLeg", *change) for change in ([0, 0.15, 0, 0, 0, 0], [0.06, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0.7])),
    ("LLeg", 0, 0, 0.04, 0, 0, 0),
]  # fmt: skip
QUICK = [turn_the_feet_in_a_plane, put_a_foot_aside_and_turn_it, bend_the_knees]
MORE = [
    turn_the_feet_at_once, turn_a_free_hip, bend_the_knees_far_and_fast,
    bend_one_knee, bend_the_hips, bend_the_ankles, spread_the_hips, kick_without_freeing_the_foot, turn_fixed_feet,
    turn_the_feet_inwards, turn_the_feet_over_one_of_them, lift_a_free_leg, lift_a_free_foot, balance_over_each_foot,
    swing_the_hips, move_torso_and_arm, reach_too_far_with_both_arms, control_an_arm, send_the_torso,
    *(shifted(*each) for each in SHIFTS),
]  # fmt: skip
NOISY = [pytest.param(run, True) for run in (*QUICK, *MORE)]


@pytest.mark.parametrize(
    ("run", "noise"),
    cases([(run, False) for run in QUICK], [*(pytest.param(run, False) for run in MORE), *NOISY]),
    ids=lambda value: getattr(value, "__name__", "noise" if value else "exact"),
)
def test_it_stands_while_a_program_moves_legs_and_torso(run, noise):
    program = Program(noise=noise)
    try:
        run(program)
        program.wait(1.0)
        assert program.tilt < UPRIGHT
    finally:
        program.rig.close()
