"""The motions in the physics of the simulation, in virtual time."""

import math

import pytest

from interfaces.nao import ActionStatus
from naoserver.bodies.parts import LYING_TILT, Stance
from naoserver.moves.routes import situation_of
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.motion_rig import MotionRig
from tests.support.soak import repeated
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim


@pytest.fixture
def rig():
    clock = VirtualClock()
    rig = MotionRig(SimulatedRobot(clock=clock, skin=False, world=load_world("empty")), clock)
    rig.let_go(0.8)
    return rig


def test_it_stands_up_where_it_has_fallen_on_its_back(rig):
    """How it gets up from its belly is a test of the H21, in test_h21.py."""
    push = math.radians(190)
    rig.robot.stage.push((80.0 * math.cos(push), 80.0 * math.sin(push), 0.0), 0.15)
    rig.let_go(3.0)
    assert rig.stance is Stance.BACK
    assert max(rig.robot.read().stiffnesses) == 0.0, "it let go in the fall"
    assert rig.go("Stand").status is ActionStatus.Done
    assert rig.posture == "Stand"
    assert min(rig.robot.read().stiffnesses) == 1.0


def test_it_goes_into_every_posture_and_is_in_it(rig):
    for posture in ("StandZero", "Crouch", "Sit", "SitRelax", "LyingBack", "LyingBelly"):
        progress = rig.go(posture)
        assert (progress.status, progress.message) == (ActionStatus.Done, "")
        assert rig.stance is rig.robot.body.postures[posture].stance
        assert rig.posture == posture


@pytest.mark.timeout(900)
def test_it_sits_down_and_stands_up_again_and_again(rig):
    for _ in range(repeated(test=2, soak=20)):
        for posture in ("Sit", "Stand"):
            rig.begin_posture(posture)
            while rig.player.busy:
                rig.let_go(0.2)
                assert situation_of(rig.robot).up[2] > math.cos(LYING_TILT), "it rolls over to get up"
            assert rig.player.progress("posture").status is ActionStatus.Done
            assert rig.posture == posture
    assert max(rig.robot.read().temperatures) < rig.robot.body.motor_heat.hot


@pytest.mark.parametrize("posture", ["Sit", "SitRelax"])
def test_it_sits_without_pressing_its_arms_hot(rig, posture):
    rig.go(posture)
    before = max(rig.robot.read().temperatures)
    rig.let_go(8.0)
    assert max(rig.robot.read().temperatures) < before + 2.0


GESTURES = ((-1.4, 0.2, -0.1), (1.4, 0.2, -1.4), (0.0, 1.2, -0.1), (0.0, 0.1, -1.0))
SWINGS = ((-1.9, 0.1, -0.1), (1.9, 0.1, -0.1))


@pytest.mark.parametrize(
    ("posture", "poses", "fraction"),
    [("StandInit", GESTURES, 1.0), ("Stand", GESTURES, 0.5), ("Stand", SWINGS, 0.5)],
)
def test_both_arms_at_the_highest_speed_do_not_throw_it_over(rig, posture, poses, fraction):
    rig.go(posture)
    body = rig.assembly.body
    for number in range(8):
        pitch, roll, elbow = poses[number % len(poses)]
        left = {"LShoulderPitch": pitch, "LShoulderRoll": roll, "LElbowRoll": elbow}
        targets = left | {"RShoulderPitch": pitch, "RShoulderRoll": -roll, "RElbowRoll": -elbow}
        body.move(targets, {joint: body.facts(joint).max_velocity for joint in targets})
        rig.let_go(0.5 / fraction)
        assert situation_of(rig.robot).up[2] > math.cos(math.radians(20))


@pytest.mark.parametrize("motion", ["dance", "wave"])
def test_it_stays_on_its_feet(rig, motion):
    rig.begin(motion)
    least = 1.0
    while rig.player.busy:
        rig.let_go(0.1)
        least = min(least, situation_of(rig.robot).up[2])
    assert rig.player.progress("motion").status is ActionStatus.Done
    assert least > math.cos(math.radians(15))
    assert rig.stance is Stance.STANDING


@pytest.mark.parametrize(("motion", "swings", "carries"), [("kick", 1, 0), ("kick_left", 0, 1)])
def test_a_kick_swings_one_foot_while_the_other_carries_all(rig, motion, swings, carries):
    rig.begin(motion)
    carried, least = [], 1.0
    while rig.player.busy:
        rig.let_go(0.02)
        senses = rig.robot.senses.read()
        carried.append((senses.left_foot.total, senses.right_foot.total))
        least = min(least, situation_of(rig.robot).up[2])
    swinging = [feet[carries] for feet in carried if feet[swings] == 0.0]
    assert len(swinging) > 25, "half a second"
    assert max(feet[carries] for feet in carried) > 40.0
    assert rig.player.progress("motion").status is ActionStatus.Done
    assert least > math.cos(math.radians(15))
    assert rig.stance is Stance.STANDING
