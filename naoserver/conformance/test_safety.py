"""Safety, through the server."""

import pytest

from interfaces.jderobot import CommandRefusedException
from interfaces.nao import HealthPrx, JointsPrx, SafetyPrx
from naoserver.conformance._robot import JOINT, RobotClient, free_joints, needs, slowly, step_of, target_of

pytestmark = needs(JOINT)


def begin_to_move(nao: RobotClient, by: RobotClient) -> tuple[str, int, float]:
    """Let a client move a joint slowly; return its name, its place and its target once it is on its way."""
    joint = free_joints(nao.robot.body)[0]
    place = nao.robot.body.joint_names.index(joint.name)
    start, body = nao.robot.read().commands[place], by.proxy(JointsPrx, "Body")
    target = {joint.name: target_of(joint, start)}
    goal = body.setJointPositions(target, slowly(nao.robot, joint))[joint.name]
    way = goal - start
    nao.readings(lambda reading: (reading.commands[place] - start) / way > 0.1, f"{joint.name} sets off")
    return joint.name, place, goal


def check_it_is_held(nao: RobotClient, place: int, goal: float, cause: str) -> None:
    """Check that a joint comes to rest on its way to a goal."""
    step = step_of(nao.robot.body.joints[place])
    nao.watched(0.3)
    commands = [reading.commands[place] for reading in nao.watched(1.0)]
    assert max(commands) - min(commands) < step / 50, f"{cause} does not hold the joint: it goes on"
    assert abs(commands[-1] - goal) > step / 4, f"{cause} does not end the way to the goal"


def test_an_emergency_stop_holds_the_joints_and_refuses_commands(rest: RobotClient) -> None:
    """An emergency stop holds the joints where they are, and refuses commands until it is reset."""
    name, place, goal = begin_to_move(rest, rest)
    safety, body = rest.proxy(SafetyPrx, "Safety"), rest.proxy(JointsPrx, "Body")
    safety.emergencyStop("enough")
    state = safety.getSafetyState()
    assert (state.stopped, state.reason) == (True, "enough")
    check_it_is_held(rest, place, goal, "an emergency stop")
    held = rest.robot.read().commands[place]
    with pytest.raises(CommandRefusedException, match="enough"):
        body.setJointPositions({name: goal}, 0.1)
    safety.resetEmergencyStop(True)
    assert rest.robot.read().commands[place] == pytest.approx(held, abs=0.01), "a reset moves nothing"
    assert body.setJointPositions({name: held}, 0.1) == {name: pytest.approx(held)}


def test_a_lease_refuses_the_commands_of_others(rest: RobotClient) -> None:
    """A lease refuses the commands of all but its holder, with whose name, until it is released."""
    joint = free_joints(rest.robot.body)[0]
    here = {joint.name: rest.robot.read().commands[rest.robot.body.joint_names.index(joint.name)]}
    body = rest.proxy(JointsPrx, "Body")
    with rest.client() as other:
        safety = other.proxy(SafetyPrx, "Safety")
        safety.acquireLease("Ann", 60.0)
        with pytest.raises(CommandRefusedException) as refusal:
            body.setJointPositions(here, 0.1)
        assert refusal.value.holder == "Ann"
        assert other.proxy(JointsPrx, "Body").setJointPositions(here, 0.1)
        body.stop()
        safety.releaseLease()
        assert body.setJointPositions(here, 0.1)


def test_what_is_limited_comes_back_and_is_counted(rest: RobotClient) -> None:
    """A target out of range is limited to it, which comes back, is counted, and is reported as an event."""
    joint = free_joints(rest.robot.body)[0]
    body, health = rest.proxy(JointsPrx, "Body"), rest.proxy(HealthPrx, "Health")
    before = health.getHealth().limitedCommands
    accepted = body.setJointPositions({joint.name: joint.upper + 10.0}, slowly(rest.robot, joint))
    body.stop()
    assert accepted == {joint.name: joint.upper}
    report = health.getHealth()
    assert report.limitedCommands == before + 1, "it is not counted"
    about = [event.message for event in report.events if event.source == joint.name]
    assert any("out of range" in message for message in about), "no event says so"


def test_the_joints_of_a_client_that_is_gone_are_held(rest: RobotClient) -> None:
    """What a client moves is held when the client is gone."""
    with rest.client() as other:
        _, place, goal = begin_to_move(rest, other)
    check_it_is_held(rest, place, goal, "the loss of a client")
