"""Postures and motions."""

import pytest

from interfaces.jderobot import InvalidValueException
from interfaces.nao import ActionState, ActionStatus, JointsPrx, MotionsPrx, PosturesPrx
from naoserver.conformance._robot import CROUCH, ROOM, WAVE, RobotClient, needs
from naoserver.moves.motion_file import load_motions

TOLERANCE = 0.1
"""In rad, of a joint that carries the body in a posture."""


def ended(state: ActionState, before: int) -> bool:
    """Return whether the action after `before` others has ended."""
    return state.count > before and state.status not in (ActionStatus.Idle, ActionStatus.Moving)


def go(nao: RobotClient, name: str, fraction: float) -> None:
    """Go into a posture, and check that it is reported."""
    postures = nao.proxy(PosturesPrx, "Postures")
    before = postures.getPostureState().count
    postures.goToPosture(name, fraction)
    nao.until(lambda: ended(postures.getPostureState(), before), f"the way to {name} ends")
    state = postures.getPostureState()
    assert (state.status, state.name, state.count) == (ActionStatus.Done, name, before + 1), state.message
    nao.until(lambda: postures.getPosture() == name, f"it says that it is in {name}")


@needs(CROUCH, ROOM)
def test_it_goes_into_a_posture_stops_on_the_way_and_says_so(rest: RobotClient) -> None:
    """It goes into a posture, stops on the way if it must, and says where it is."""
    robot, postures = rest.robot, rest.proxy(PosturesPrx, "Postures")
    known = robot.body.postures
    upright = next(iter(known))
    assert set(postures.getPostures()) >= known.keys()
    go(rest, upright, 1.0)
    start, crouched = known[upright].angles, known["Crouch"].angles
    bent = max(start.keys() & crouched.keys(), key=lambda name: abs(start[name] - crouched[name]))
    place = robot.body.joint_names.index(bent)
    # Slowly: the stop is to come in time on a busy machine, too.
    postures.goToPosture("Crouch", 0.15 / max(1.0, robot.clock.rate))
    rest.readings(lambda now: abs(now.positions[place] - start[bent]) > TOLERANCE, f"{bent} bends")
    postures.stop()
    rest.until(lambda: ended(postures.getPostureState(), 0), "a stop ends the way")
    assert postures.getPostureState().status in (ActionStatus.Stopped, ActionStatus.Failed)
    assert postures.getPosture() != "Crouch"

    go(rest, "Crouch", 1.0)
    rest.readings(
        lambda now: abs(now.positions[place] - crouched[bent]) < TOLERANCE, f"{bent} is where it is in Crouch"
    )
    go(rest, upright, 1.0)


@needs(WAVE, ROOM)
def test_a_motion_owns_its_joints_until_it_ends(rest: RobotClient) -> None:
    """A motion owns its joints until it is stopped, which holds them, or until it is done."""
    motions, body = rest.proxy(MotionsPrx, "Motions"), rest.proxy(JointsPrx, "Body")
    assert {motion.name for motion in motions.getMotions()} == load_motions(rest.robot.body).keys()
    before = motions.getMotionState().count
    motions.play("wave", 0.5)
    rest.until(lambda: motions.getMotionState().progress > 0.05, "it waves")
    with pytest.raises(InvalidValueException, match="wave"):
        body.setJointPositions(dict.fromkeys(rest.robot.body.joint_names, 0.0), 0.1)
    motions.stop()
    rest.until(lambda: ended(motions.getMotionState(), before), "a stop ends the wave")
    assert motions.getMotionState().status is ActionStatus.Stopped
    rest.until(lambda: max(map(abs, rest.robot.read().velocities)) < 0.1, "a stop holds the joints")

    motions.play("wave", 2.0)
    rest.until(lambda: ended(motions.getMotionState(), before + 1), "the wave ends")
    state = motions.getMotionState()
    assert (state.status, state.name, state.progress) == (ActionStatus.Done, "wave", 1.0), state.message
    moved = load_motions(rest.robot.body)["wave"].keys
    assert all(map(rest.is_free, moved)), "the wave keeps its joints"
