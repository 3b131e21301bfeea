"""Whole body control over NAOqi, with a simulated robot that balances and a fake one that cannot."""

import math

import pytest

pytest.importorskip("qi")

from naoserver.bodies.capabilities import Support
from naoserver.errors import InvalidCommand
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from plugins.naoqi.tests.support.rig import Rig
from tests.support.leg_motions import ONE_LEG
from tests.support.soak import cases
from visualhfsm_naoqi.programs._clients import Client, running
from visualhfsm_naoqi.programs._effectors import EffectorMotion
from visualhfsm_naoqi.programs._whole_body import WholeBody

pytestmark = pytest.mark.sim

ROBOT = 2
ALL_AXES = 63
UPRIGHT = math.radians(30)
HALF_A_SOLE = 0.035
"""Distance in m from the ankle to the inner edge, less 4 mm."""


@pytest.fixture
def simulated():
    """A simulated robot in StandInit."""
    world = load_world("empty")
    rig = Rig(lambda clock: SimulatedRobot(clock=clock, world=world, skin=False))
    rig.advance(0.5)
    yield rig
    rig.close()


@pytest.fixture
def body(simulated):
    """Its whole body control, which is enabled."""
    body = simulated.access.service(WholeBody)
    body.wbEnable(True)
    return body


def result(rig, operation, *arguments):
    call = rig.begin(operation, *arguments)
    while not call.ended:
        rig.advance(0.02)
    assert call.error is None
    return call.result


def test_it_balances_over_the_feet_that_the_program_leaves(simulated, body):
    support = simulated.robot.balancer.support
    assert support() is Support.LEGS
    body.wbFootState("Free", "RLeg")
    assert support() is Support.LEFT
    body.wbEnableBalanceConstraint(True, "RLeg")
    assert support() is Support.RIGHT
    body.wbEnableBalanceConstraint(False, "RLeg")
    assert support() is Support.LEFT
    body.wbFootState("Fixed", "Legs")
    assert support() is Support.LEGS
    body.wbFootState("Free", "Legs")
    assert support() is Support.LEGS


def test_a_foot_stays_where_it_is_only_under_whole_body_control(simulated, body):
    body.wbEnable(False)
    body.wbFootState("Fixed", "Legs")
    (before,) = simulated.positions("LHipPitch")
    simulated.motion.setAngles("LKneePitch", 0.9, 0.1)
    simulated.advance(0.2)
    assert simulated.positions("LHipPitch") == pytest.approx([before], abs=0.02)


def test_no_choice_of_feet_outlasts_whole_body_control(simulated, body):
    body.wbFootState("Free", "RLeg")
    body.wbEnable(False)
    body.wbEnable(True)
    assert simulated.robot.balancer.support() is Support.LEGS


def test_a_free_leg_goes_where_it_is_sent_beside_a_fixed_foot(simulated, body):
    body.wbFootState("Fixed", "LLeg")
    body.wbFootState("Free", "RLeg")
    (before,) = simulated.positions("RKneePitch")
    simulated.motion.setAngles("RKneePitch", before + 0.3, 0.1)
    simulated.advance(1.0)
    assert simulated.positions("RKneePitch") == pytest.approx([before + 0.3], abs=0.05)


def test_it_still_balances_when_whole_body_control_ends(simulated, body):
    body.wbEnableBalanceConstraint(True, "LLeg")
    body.wbEnable(False)
    assert simulated.robot.balancer.support() is Support.LEGS
    body.wbFootState("Free", "RLeg")
    assert simulated.robot.balancer.support() is Support.LEGS


def test_a_motion_of_the_legs_is_balanced_and_one_of_the_arms_changes_nothing(simulated):
    motion, balancer = simulated.motion, simulated.robot.balancer
    simulated.complete(motion.angleInterpolation, "LShoulderPitch", 1.0, 0.5, True)
    assert balancer.support() is None
    simulated.complete(motion.angleInterpolation, "LAnkleRoll", 0.05, 0.5, True)
    assert balancer.support() is Support.LEGS
    simulated.complete(simulated.postures.goToPosture, "StandInit", 0.8)
    assert balancer.support() is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("leg", "share"), cases([("LLeg", 0.55)], [pytest.param("RLeg", 0.55), pytest.param("Legs", 0.4)])
)
def test_the_weight_goes_over_a_foot_and_both_stay_on_the_floor(simulated, body, leg, share):
    assert result(simulated, body.wbGoToBalance, leg, 1.5) is True
    simulated.advance(0.5)
    assert simulated.robot.balancer.support() is Support(leg)
    senses = simulated.robot.senses.read()
    left, right = senses.left_foot.total, senses.right_foot.total
    assert min(left, right) > 3.0
    assert (right if leg == "RLeg" else left) / (left + right) > share


@pytest.mark.slow
@pytest.mark.parametrize(
    "supports", cases([("LLeg", "RLeg", "RLeg")], [("RLeg", "LLeg", "LLeg")]), ids="-".join
)
def test_it_kicks_with_one_foot_after_the_other_though_the_program_fixes_none_again(
    simulated, body, supports
):
    effectors = simulated.access.service(EffectorMotion)
    path = [[-0.05, 0, 0.05, 0, 0.09, 0], [0.05, 0, 0.05, 0, 0, 0], [0, 0, 0, 0, 0, 0]]
    for support in supports:
        foot = "RLeg" if support == "LLeg" else "LLeg"
        assert result(simulated, body.wbGoToBalance, support, 1.5)
        body.wbFootState("Free", foot)
        body.wbEnableEffectorOptimization(foot, False)
        times = [1.5, 1.8, 3.0]
        call = simulated.begin(effectors.positionInterpolation, foot, ROBOT, path, ALL_AXES, times, False)
        lifted = False
        while not call.ended:
            simulated.advance(0.02)
            senses = simulated.robot.senses.read()
            lifted = lifted or (senses.right_foot if foot == "RLeg" else senses.left_foot).total == 0.0
            assert simulated.robot.state().torso_tilt < UPRIGHT
        assert lifted


def test_nothing_moves_before_whole_body_control_is_enabled(rig):
    body = rig.access.service(WholeBody)
    before = rig.access.angles(measured=False)
    assert result(rig, body.wbGoToBalance, "LLeg", 1.0) is False
    body.wbSetEffectorControl("LArm", [0.1, 0.1, 0.3])
    rig.advance(1.0)
    assert rig.access.angles(measured=False) == before


def test_a_robot_that_cannot_balance_still_moves_its_weight(rig):
    body = rig.access.service(WholeBody)
    body.wbEnable(True)
    assert result(rig, body.wbGoToBalance, "RLeg", 1.0) is True
    _, y, _ = rig.motion.getCOM("Body", ROBOT, False)
    away = y - rig.motion.getPosition("RLeg", ROBOT, False)[1]
    assert abs(away) < HALF_A_SOLE


@pytest.mark.slow
def test_a_stop_ends_the_way_to_balance_and_chooses_no_foot(simulated, body):
    call = simulated.begin(body.wbGoToBalance, "LLeg", 2.0)
    simulated.advance(0.5)
    simulated.motion.killAll()
    simulated.advance(0.04)
    call.join()
    assert call.result is False
    assert simulated.robot.balancer.support() is Support.LEGS


@pytest.mark.slow
def test_a_program_that_is_lost_on_one_leg_leaves_a_robot_that_stands(simulated):
    client = Client("lost")
    call = simulated.begin(simulated.motion.angleInterpolation, *ONE_LEG, client=client)
    simulated.advance(2.1)
    simulated.access.lose(client)
    simulated.advance(0.04)
    call.join()
    for _ in range(150):
        simulated.advance(0.02)
        assert simulated.robot.state().torso_tilt < UPRIGHT


@pytest.mark.slow
def test_a_way_to_a_posture_is_not_balanced_whatever_a_program_sends(simulated, body):
    motion, balancer = simulated.motion, simulated.robot.balancer
    posture = simulated.begin(simulated.postures.goToPosture, "Crouch", 0.5)
    simulated.advance(0.1)
    assert balancer.support() is None
    refused = simulated.begin(motion.angleInterpolation, "LAnkleRoll", 0.05, 0.5, True)
    simulated.advance(0.1)
    refused.join()
    body.wbEnableBalanceConstraint(True, "LLeg")
    assert "moved by the posture" in str(refused.error)
    assert balancer.support() is None
    while not posture.ended:
        simulated.advance(0.02)
    simulated.complete(motion.angleInterpolation, "LAnkleRoll", 0.02, 0.2, True)
    assert balancer.support() is Support.LEFT


def test_the_choices_of_a_lost_program_end(simulated):
    body, client = simulated.access.service(WholeBody), Client("lost")
    with running(simulated.arrive(body.wbEnable, True, client=client)):
        body.wbEnable(True)
        body.wbFootState("Free", "RLeg")
    assert simulated.robot.balancer.support() is Support.LEFT
    simulated.access.lose(client)
    assert simulated.robot.balancer.support() is Support.LEGS
    body.wbFootState("Free", "RLeg")
    assert simulated.robot.balancer.support() is Support.LEGS


def test_an_effector_follows_its_target_while_it_is_controlled(rig):
    body = rig.access.service(WholeBody)
    body.wbEnable(True)
    body.wbEnableEffectorControl("LArm", True)
    x, y, z, *_ = rig.motion.getPosition("LArm", ROBOT, False)
    body.wbSetEffectorControl("LArm", [x, y, z + 0.05])
    rig.advance(2.0)
    assert rig.motion.getPosition("LArm", ROBOT, False)[:3] == pytest.approx([x, y, z + 0.05], abs=0.005)
    body.wbEnableEffectorControl("Head", True)
    body.wbSetEffectorControl("Head", [0.0, 0.1, 0.4])
    rig.advance(2.0)
    assert rig.positions("HeadPitch", "HeadYaw") == pytest.approx([0.1, 0.4], abs=1e-3)
    body.wbEnableEffectorControl("Head", False)
    body.wbSetEffectorControl("Head", [0.0, 0.0, 0.0])
    rig.advance(1.0)
    assert rig.positions("HeadYaw") == pytest.approx([0.4], abs=1e-3)


@pytest.mark.parametrize(
    ("operation", "arguments", "message"),
    [
        ("wbFootState", ("Fixed", "Tail"), "no leg 'Tail'"),
        ("wbFootState", ("Lost", "LLeg"), "no state of a foot 'Lost'"),
        ("wbEnableBalanceConstraint", (True, "Tail"), "no leg 'Tail'"),
        ("wbEnableEffectorControl", ("Tail", True), "no effector 'Tail'"),
        ("wbEnableEffectorOptimization", ("Tail", True), "no effector 'Tail'"),
        ("wbSetEffectorControl", ("Head", [0.0]), "1 entries, not 3"),
    ],
)
def test_what_is_no_choice(rig, operation, arguments, message):
    with pytest.raises(InvalidCommand, match=message):
        getattr(rig.access.service(WholeBody), operation)(*arguments)
