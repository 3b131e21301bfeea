"""The walk over ALMotion."""

from dataclasses import replace

import pytest

from interfaces.nao import ActionStatus
from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.errors import InvalidCommand
from naoserver.hardware.connection import CallFailed
from naoserver.moves.walk import way_to
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from plugins.naoqi.tests.support.scripted import DEVICES, HASTY, ScriptedNaoqi
from tests.support.limits import FOREVER
from tests.support.robot_server import eventually
from tests.support.waiting import at_once
from visualhfsm_naoqi._names import gait_limits
from zenoh_ice import RobotClock, WallClock

MOVE, STOP, ACTIVE = "ALMotion.move", "ALMotion.stopMove", "ALMotion.moveIsActive"


@pytest.fixture
def naoqi():
    return ScriptedNaoqi(speed=4.0)


def test_it_walks_in_si_units(naoqi):
    naoqi.answers[ACTIVE] = True
    with naoqi.robot() as robot:
        robot.walker.command(WalkVelocity(0.05, -0.01, 0.2))
        assert naoqi.wait_for_call(MOVE) == (0.05, -0.01, 0.2)
        assert robot.walker.commanded() == WalkVelocity(0.05, -0.01, 0.2)


def test_what_is_renewed_is_sent_once(naoqi):
    naoqi.answers[ACTIVE] = True
    with naoqi.robot() as robot:
        for _ in range(5):
            robot.walker.command(WalkVelocity(forward=0.05))
        assert len(naoqi.called(MOVE)) == 1


def test_it_walks_until_the_robot_says_that_it_stands(naoqi):
    naoqi.answers[ACTIVE] = True
    with naoqi.robot() as robot:
        robot.walker.command(WalkVelocity(forward=0.05))
        naoqi.wait_for_call(MOVE)
        robot.walker.command(STILL)
        naoqi.wait_for_call(STOP, 2)
        assert robot.walker.walking
        naoqi.answers[ACTIVE] = False
        eventually(lambda: not robot.walker.walking)


def test_a_walk_that_the_robot_ended_is_not_commanded_any_more(naoqi):
    naoqi.answers[ACTIVE] = True
    with naoqi.robot() as robot:
        robot.walker.command(WalkVelocity(turn=0.2))
        naoqi.wait_for_call(MOVE)
        naoqi.answers[ACTIVE] = False
        eventually(lambda: not robot.walker.walking)
        assert robot.walker.commanded() == STILL


@pytest.fixture
def walking(naoqi):
    """Walk to a place with the server's parts; return the message at its end, and the reported events."""

    def walk(change):
        with naoqi.robot() as robot:
            assembly = Assembly(robot, ServerOptions(), WallClock())
            walk_to = assembly.walk_to
            assert walk_to is not None
            way = way_to((1.0, 0.0, 0.0), robot.walker.odometry(), robot.walker.limits)
            walk_to.begin(way, "anna")
            change()

            def ended():
                walk_to.tick()
                return not walk_to.busy

            eventually(ended)
            state = walk_to.state()
            for watched in assembly.watched:
                watched.watch()
            assembly.close()
        assert state.status is ActionStatus.Stopped
        return state.message, [event.message for event in assembly.events.snapshot()[0]]

    return walk


def refuse(*_arguments):
    raise CallFailed("ALMotion.move: the robot is in its pod")


def test_a_walk_that_the_robot_refuses_says_why(naoqi, walking):
    naoqi.answers[MOVE] = refuse
    message, events = walking(lambda: None)
    assert message == "the robot ended the walk: it refused to walk: ALMotion.move: the robot is in its pod"
    assert message in events
    assert not any("or it was moved" in event for event in events)


@pytest.mark.parametrize(
    ("angle", "reason"), [(1.5, "it has fallen"), (0.0, "NAOqi stopped it, and does not say why")]
)
def test_a_walk_that_the_robot_ended_says_what_is_known(naoqi, angle, reason):
    naoqi.answers[ACTIVE] = True
    with naoqi.robot() as robot:
        robot.walker.command(WalkVelocity(forward=0.05))
        naoqi.wait_for_call(MOVE)
        naoqi.memory[f"{DEVICES}InertialSensor/AngleY/Sensor/Value"] = angle
        eventually(lambda: robot.state().fallen == (angle > 1.0))
        naoqi.answers[ACTIVE] = False
        eventually(lambda: not robot.walker.walking)
        assert robot.walker.ended == reason
        naoqi.memory[f"{DEVICES}InertialSensor/AngleY/Sensor/Value"] = 0.0
        eventually(lambda: not robot.state().fallen)
        robot.walker.command(WalkVelocity(forward=0.05))
        assert robot.walker.ended == ""


def test_a_walk_of_a_lost_robot_says_so(naoqi, walking):
    naoqi.answers[ACTIVE] = True

    def lose():
        naoqi.wait_for_call(MOVE)
        naoqi.lose()

    message, _ = walking(lose)
    assert message == "the robot ended the walk: the robot was lost"


def test_a_robot_that_is_closed_stands(naoqi):
    naoqi.answers[ACTIVE] = True
    with naoqi.robot() as robot:
        robot.walker.command(WalkVelocity(forward=0.05))
        naoqi.wait_for_call(MOVE)
    assert [call[0] for call in naoqi.calls if call[0] in (MOVE, STOP)] == [STOP, MOVE, STOP]


def refusing(times, operation):
    """Return an answer that refuses a call some times."""
    left = [CallFailed(f"{operation}: busy")] * times

    def answer(*_arguments):
        if left:
            raise left.pop()

    return answer


def test_a_stop_that_is_refused_is_repeated_until_it_is_not(caplog):
    # So slow that it does not also walk on for long enough to be stopped for that.
    naoqi = ScriptedNaoqi(speed=0.3)
    naoqi.answers[ACTIVE] = True
    with naoqi.robot() as robot:
        assert isinstance(robot.clock, RobotClock)
        robot.walker.command(WalkVelocity(forward=0.05))
        naoqi.answers[STOP] = refusing(2, STOP)
        robot.walker.command(STILL)
        naoqi.wait_for_call(STOP, 4)
        naoqi.answers[ACTIVE] = False
        robot.clock.update(robot.clock.now(), 4.0, False)  # now it may hurry
        eventually(lambda: not robot.walker.walking)
        assert len(naoqi.called(STOP)) == 4, "one is for the walk of before"
        assert [call[0] for call in naoqi.calls if call[0] in (MOVE, STOP)].count(MOVE) == 1
    assert "a stop (walk) is repeated until the robot carries it out: ALMotion.stopMove: busy" in caplog.text


def test_a_stop_is_repeated_while_the_robot_walks_on(naoqi, caplog):
    naoqi.answers[ACTIVE] = True
    with naoqi.robot() as robot:
        robot.walker.command(WalkVelocity(forward=0.05))
        robot.walker.command(STILL)
        naoqi.wait_for_call(STOP, 4)
        naoqi.answers[ACTIVE] = False
        eventually(lambda: not robot.walker.walking)
    assert "the robot walks on though it was stopped" in caplog.text


def test_a_walk_of_somebody_else_is_left_alone(naoqi):
    with naoqi.robot() as robot:
        naoqi.answers[ACTIVE] = True
        eventually(lambda: robot.walker.walking)
        begun = robot.clock.now()
        eventually(lambda: robot.clock.now() > begun + 1.5)
        assert len(naoqi.called(STOP)) == 1


def test_a_stop_is_repeated_when_the_robot_runs_an_older_command_late(naoqi):
    naoqi.answers[ACTIVE] = True
    naoqi.limits = replace(HASTY, answer=0.2)
    naoqi.held.add(MOVE)
    with naoqi.robot() as robot:
        robot.walker.command(WalkVelocity(forward=0.05))
        robot.walker.command(STILL)
        naoqi.wait_for_call(STOP, 3)  # it goes on while the walk may still begin
        naoqi.let_go(MOVE)
        ran = len(naoqi.called(STOP))
        naoqi.wait_for_call(STOP, ran + 1)
        naoqi.answers[ACTIVE] = False
        eventually(lambda: not robot.walker.walking)


@at_once
def test_a_stop_waits_for_no_unanswered_call_and_is_repeated_after_it(naoqi):
    naoqi.limits = replace(HASTY, answer=FOREVER)
    naoqi.held.add(MOVE)
    with naoqi.robot() as robot:
        before = len(naoqi.called(STOP))
        robot.walker.command(WalkVelocity(forward=0.05))
        for _ in range(20):  # as `nao stop` does until the robot confirms it
            robot.walker.command(STILL)
        assert len(naoqi.called(STOP)) == before + 1
        naoqi.let_go(MOVE)
        naoqi.wait_for_call(STOP, before + 2)


def test_a_walk_of_before_is_ended_when_the_robot_is_found(naoqi):
    with naoqi.robot():
        assert naoqi.called(STOP) == [()]


def test_legs_that_are_limp_do_not_walk(naoqi):
    naoqi.memory[f"{DEVICES}RKneePitch/Hardness/Actuator/Value"] = 0.0
    with naoqi.robot() as robot, pytest.raises(InvalidCommand, match="RKneePitch is limp"):
        robot.walker.command(WalkVelocity(forward=0.05))


def test_a_robot_that_lies_does_not_walk(naoqi):
    naoqi.memory[f"{DEVICES}InertialSensor/AngleY/Sensor/Value"] = 1.5
    with naoqi.robot() as robot:
        assert robot.state().fallen
        with pytest.raises(InvalidCommand, match="fallen"):
            robot.walker.command(WalkVelocity(forward=0.05))


def test_the_odometry_is_the_robots(naoqi):
    naoqi.answers["ALMotion.getRobotPosition"] = lambda _sensors: [1.0, -2.0, 0.5]
    with naoqi.robot() as robot:
        eventually(lambda: robot.walker.odometry().x == 1.0)
        odometry = robot.walker.odometry()
        assert (odometry.y, odometry.heading) == (-2.0, 0.5)


def test_the_limits_follow_from_the_steps():
    config = {"MaxStepX": 0.04, "MaxStepY": 0.14, "MaxStepTheta": 0.349, "MaxStepFrequency": 1.0}
    limits = gait_limits(config)
    assert (limits.forward, limits.left, limits.turn) == pytest.approx((0.0952, 0.0476, 0.831), abs=1e-3)
    assert gait_limits({**config, "MaxStepFrequency": 0.0}).forward == pytest.approx(0.04 / 0.6)
