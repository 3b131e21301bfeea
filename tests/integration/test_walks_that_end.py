"""What ends the motion of every robot that moves over the floor, and leaves it standing, or limp where it fell."""

import math

import pytest

from interfaces.jderobot import EncodersPrx, InvalidValueException, MotorsPrx
from interfaces.nao import (
    GroundTruthPrx,
    HealthPrx,
    JointsPrx,
    PosturesPrx,
    ScenePrx,
    Vector3,
)
from naoserver.moves.motion_file import load_motions
from naoserver_sim._locomotion import STUCK
from tests.support.conformance import FAMILIES, PATIENT, in_simulation, robots
from tests.support.robot_server import eventually, wait_for

SPEED = 0.12
"""In m/s: every robot moves at it."""
PART_OF_WEIGHT = 0.2
"""Least part of its weight that each foot of a robot on both feet bears."""
THROW = 1.2
"""Force, as a part of its weight, that throws a robot over."""
LIMP_WITHIN = 1.5
"""Seconds from such a push to limp motors."""


@pytest.fixture(params=robots(lambda body: body.walk, bodies=FAMILIES, weight=True))
def nao(request):
    """A robot that is served, whose velocities need not be renewed, and a client's session."""
    with request.param(PATIENT) as nao:
        yield nao


def walk_on(nao, client=None):
    """Walk until the robot has come some way, in whichever direction a fall has left it."""
    encoders = nao.proxy(EncodersPrx, "Encoders")
    start = encoders.getEncodersData()
    (client or nao).proxy(MotorsPrx, "Motors").setV(SPEED)

    def has_come(data):
        return math.hypot(data.robotx - start.robotx, data.roboty - start.roboty) > 0.05

    wait_for(encoders.getEncodersData, has_come)


def accepts_a_walk(nao):
    """Walk, unless the robot still senses that it lies."""
    try:
        nao.proxy(MotorsPrx, "Motors").setV(SPEED)
    except InvalidValueException:
        return False
    return True


def stands(nao):
    """Return whether it rests, upright and on both feet, if it has feet."""
    if nao.robot.walker.walking or nao.robot.state().torso_tilt > 0.2:
        return False
    if nao.robot.stage is None or not nao.robot.body.soles:
        return True
    least = PART_OF_WEIGHT * 9.81 * nao.robot.body.mass
    return min(nao.robot.senses.record.loads()) > least


def events(nao):
    return [event.message for event in nao.proxy(HealthPrx, "Health").getHealth().events]


@pytest.mark.parametrize("nao", robots(lambda body: body.walk, bodies=FAMILIES), indirect=True)
def test_the_walk_of_a_client_that_is_lost_ends_and_the_next_one_walks(nao):
    with nao.client() as other:
        walk_on(nao, other)
    eventually(lambda: stands(nao))
    assert "stopped (forward): the client that drove it is gone" in events(nao)
    walk_on(nao)


def lies_for_good(body):
    """Return whether no motion of a body that can fall leads from the floor to its feet."""
    return body.falls and not any("stand_up" in name for name in load_motions(body))


@in_simulation(lambda body: body.falls, bodies=FAMILIES)
def test_a_robot_that_is_thrown_over_while_it_walks_is_limp_and_says_why_its_walk_ended(nao):
    walk_on(nao)
    body, scene = nao.proxy(JointsPrx, "Body"), nao.proxy(ScenePrx, "Scene")
    force = THROW * 9.81 * nao.robot.body.mass
    begin = body.getJointState().time
    scene.pushRobot(Vector3(x=0.0, y=force, z=0.0), 0.3)
    limp = wait_for(body.getJointState, lambda state: max(state.stiffnesses) == 0.0)
    assert limp.time - begin < LIMP_WITHIN
    eventually(lambda: nao.robot.state().fallen)
    assert not nao.robot.walker.walking
    why = "it lies, or it falls; make it stand up first"
    assert nao.robot.walker.ended == why
    # A step that catches a robot may have been the first sign.
    ends = {f"the robot ended the walk: {each}" for each in (why, STUCK)}
    eventually(lambda: ends & set(events(nao)))
    motors = nao.proxy(MotorsPrx, "Motors")
    motors.stop()  # the velocities of who does not let go are limited to 0
    with pytest.raises(InvalidValueException, match=why):
        motors.setV(SPEED)
    if lies_for_good(nao.robot.body):
        with pytest.raises(
            InvalidValueException, match=r"it is lying .* no motions lead from there to Stand"
        ):
            nao.proxy(PosturesPrx, "Postures").goToPosture("Stand", 0.5)
    assert max(body.getJointState().stiffnesses) == 0.0

    scene.reset()
    eventually(lambda: stands(nao))
    eventually(lambda: accepts_a_walk(nao))
    walk_on(nao)


@in_simulation(lambda body: body.walk, bodies=FAMILIES)
def test_a_robot_that_is_placed_elsewhere_stands_there(nao):
    walk_on(nao)
    truth, scene = nao.proxy(GroundTruthPrx, "GroundTruth"), nao.proxy(ScenePrx, "Scene")
    scene.placeRobot(-0.4, 0.3, math.pi / 2)

    def is_there(seen):
        place, turn = seen.torso.position, seen.torso.orientation
        heading = 2.0 * math.atan2(turn.z, turn.w)
        return math.hypot(place.x + 0.4, place.y - 0.3) < 0.1 and abs(heading - math.pi / 2) < 0.2

    wait_for(truth.getGroundTruth, is_there)
    eventually(lambda: stands(nao))
    assert is_there(truth.getGroundTruth())
