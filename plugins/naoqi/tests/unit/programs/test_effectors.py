"""Cartesian control of ALMotion over a fake robot, in virtual time."""

import math

import pytest

pytest.importorskip("qi")

from naoserver.errors import InvalidCommand
from visualhfsm_naoqi.programs._effectors import EffectorMotion

TORSO, WORLD, ROBOT = 0, 1, 2
POSITION, ALL = 7, 63


@pytest.fixture(autouse=True)
def stands(rig):
    rig.complete(rig.postures.goToPosture, "StandInit", 1.0)


@pytest.fixture
def effectors(rig):
    return rig.access.service(EffectorMotion)


def place(rig, name, frame=TORSO):
    return rig.motion.getPosition(name, frame, False)


def shifted(place, *change):
    return [value + more for value, more in zip(place, (*change, 0, 0, 0)[:6], strict=True)]


def test_a_hand_goes_along_a_path_in_its_time(rig, effectors):
    start = place(rig, "LArm")
    path = [shifted(start, 0.0, 0.03, 0.03), shifted(start, 0.0, 0.0, 0.05)]
    call = rig.begin(effectors.positionInterpolation, "LArm", TORSO, path, POSITION, [1.0, 2.0], True)
    rig.advance(1.0)
    assert place(rig, "LArm")[:3] == pytest.approx(path[0][:3], abs=0.005)
    rig.advance(1.5)
    call.join()
    assert place(rig, "LArm")[:3] == pytest.approx(path[1][:3], abs=0.002)


def test_a_path_is_relative_where_it_is_said_to_be(rig, effectors):
    start = place(rig, "RArm")
    rig.complete(effectors.positionInterpolation, "RArm", TORSO, [0, -0.03, 0.02, 0, 0, 0], 7, 1.0, False)
    assert place(rig, "RArm")[:3] == pytest.approx(shifted(start, 0, -0.03, 0.02)[:3], abs=0.002)


@pytest.mark.slow
def test_the_torso_sinks_over_its_feet(rig, effectors):
    feet = [place(rig, leg, ROBOT) for leg in ("LLeg", "RLeg")]
    start = place(rig, "Torso", ROBOT)
    goal = shifted(start, 0.01, 0.0, -0.04)
    rig.complete(effectors.positionInterpolation, "Torso", ROBOT, [goal], ALL, [2.0], True)
    assert place(rig, "Torso", ROBOT)[2] == pytest.approx(goal[2], abs=0.002)
    for leg, before in zip(("LLeg", "RLeg"), feet, strict=True):
        # The robot's frame moves with the torso on the floor.
        assert place(rig, leg, ROBOT) == pytest.approx(shifted(before, -0.01, 0.0, 0.0), abs=0.003)


def test_several_effectors_move_at_the_same_time(rig, effectors):
    arms = {name: place(rig, name) for name in ("LArm", "RArm")}
    goals = [[shifted(start, 0.0, 0.0, 0.04)] for start in arms.values()]
    took = rig.complete(
        effectors.positionInterpolations, list(arms), TORSO, goals, [POSITION] * 2, [[1.0], [1.0]]
    )
    assert took == pytest.approx(1.0, abs=0.2)
    for name, (goal,) in zip(arms, goals, strict=True):
        assert place(rig, name)[:3] == pytest.approx(goal[:3], abs=0.002)


def test_a_head_turns_by_a_transform(rig, effectors):
    yaw = 0.4
    turned = [math.cos(yaw), -math.sin(yaw), 0, 0, math.sin(yaw), math.cos(yaw), 0, 0, 0, 0, 1, 0.1265]
    rig.complete(effectors.transformInterpolation, "Head", TORSO, [turned], 56, [1.0], True)
    assert rig.motion.getAngles(["HeadYaw", "HeadPitch"], False) == pytest.approx([yaw, 0.0], abs=0.01)


def test_a_hand_is_sent_to_a_place_at_once(rig, effectors):
    goal = shifted(place(rig, "LArm"), 0.0, 0.03, 0.03)
    effectors.setPositions(["LArm"], TORSO, [goal], 0.5, POSITION)
    rig.advance(2.0)
    assert place(rig, "LArm")[:3] == pytest.approx(goal[:3], abs=0.002)
    effectors.changePosition("LArm", TORSO, [0.0, 0.0, -0.02, 0, 0, 0], 0.5, POSITION)
    rig.advance(2.0)
    assert place(rig, "LArm")[:3] == pytest.approx(shifted(goal, 0, 0, -0.02)[:3], abs=0.002)


@pytest.mark.slow
def test_out_of_reach_it_comes_as_near_as_it_can(rig, effectors):
    goal = [1.0, 0.3, 0.1, 0, 0, 0]
    rig.complete(effectors.positionInterpolation, "LArm", TORSO, [goal], POSITION, [2.0], True)
    x, y, z = place(rig, "LArm")[:3]
    assert x > 0.19
    assert math.isfinite(y + z)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("Tail", 0, [[0] * 6], 7, [1.0]), "no effector 'Tail'"),
        (("LArm", 5, [[0] * 6], 7, [1.0]), "no frame '5'"),
        (("LArm", 0, [[0] * 5], 7, [1.0]), "5 entries, not 6"),
        (("LArm", 0, [[0] * 6], 99, [1.0]), "from 0 to 63"),
        (("LArm", 0, [[0] * 6], 7, [1.0, 2.0]), "2 times for 1 keys"),
        (("LArm", 0, [[math.nan] * 6], 7, [1.0]), "not a finite number"),
    ],
)
def test_what_is_no_path(rig, effectors, arguments, message):
    call = rig.begin(effectors.positionInterpolation, *arguments)
    call.join()
    assert message in str(call.error)


def test_a_transform_must_be_a_rotation(effectors):
    with pytest.raises(InvalidCommand, match="must be a rotation"):
        effectors.setTransform("Head", TORSO, [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0], 0.5, 63)


def test_masses_are_those_of_the_body(rig):
    body = rig.motion
    assert body.getMass("Body") == pytest.approx(5.36, abs=0.01)
    assert body.getMass("LArm") == pytest.approx(body.getMass("RArm"), rel=0.01)
    _x, y, z = body.getCOM("Body", ROBOT, False)
    assert abs(y) < 0.005
    assert 0.2 < z < 0.35
    with pytest.raises(InvalidCommand, match="no part 'Tail'"):
        body.getMass("Tail")
