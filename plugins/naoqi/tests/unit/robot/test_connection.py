"""A robot that is lost and found again."""

import threading
from dataclasses import replace

import pytest

from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.errors import HardwareFailure, InvalidCommand, RobotError
from naoserver.hardware.connection import CallFailed
from plugins.naoqi.tests.support.scripted import HASTY, PATIENT, ScriptedNaoqi
from tests.support.robot_server import eventually
from visualhfsm_naoqi.robot._robot import NaoqiRobot

STATE = "ALMemory.getListData"


@pytest.fixture
def naoqi():
    return ScriptedNaoqi(replace(PATIENT, retry=0.01))


def test_a_robot_that_is_not_there_is_reported_at_the_start(naoqi):
    naoqi.reachable = False
    robot = NaoqiRobot(naoqi.connect)
    with pytest.raises(RobotError, match="nobody is there"):
        robot.start()
    robot.close()


def test_a_lost_robot_is_reported_and_found_again(naoqi, caplog):
    caplog.set_level("INFO")
    with naoqi.robot() as robot:
        naoqi.held.add(STATE)
        eventually(lambda: bool(naoqi.links[0].open))  # in a call, so that its failure is the reason
        naoqi.lose()
        naoqi.held.clear()
        eventually(lambda: "lost the robot: Socket is not connected" in caplog.text)
        before = robot.read()
        naoqi.reachable = True
        eventually(lambda: "found the robot again" in caplog.text)
        eventually(lambda: robot.read().time > before.time)
    assert len(naoqi.links) == 2


@pytest.mark.slow
def test_a_silent_robot_is_lost(naoqi, caplog):
    naoqi.limits = replace(HASTY, silence=0.2)
    with naoqi.robot():
        naoqi.held.add(STATE)
        eventually(lambda: "lost the robot: ALMemory.getListData: no answer within 0.2 s" in caplog.text)
        assert naoqi.links[0].lost.is_set(), "it hangs up"
        naoqi.held.clear()


def test_a_command_for_which_no_thread_can_start_is_refused_and_the_next_one_is_sent(naoqi, monkeypatch):
    with naoqi.robot() as robot:
        with monkeypatch.context() as patch:
            patch.setattr(threading.Thread, "start", no_thread)
            with pytest.raises(HardwareFailure, match="not sent: can't start new thread"):
                robot.command_velocities({"HeadYaw": 0.5})
            assert not naoqi.called("ALMotion.setAngles")
            robot.command_velocities({"HeadYaw": 0.0})
            naoqi.wait_for_call("ALMotion.changeAngles")  # a stop is sent in any case
        robot.command_velocities({"HeadYaw": 0.5})
        naoqi.wait_for_call("ALMotion.setAngles")


def no_thread(thread):
    raise RuntimeError("can't start new thread")


def test_while_it_is_lost_setpoints_stay_and_commands_do_nothing(naoqi):
    with naoqi.robot() as robot:
        robot.command_velocities({"HeadYaw": 0.5})
        assert robot.state().real_time_factor == 1.0
        naoqi.lose()
        eventually(lambda: robot.state().real_time_factor == 0.0)
        setpoint = robot.read().commands[0]
        sent = len(naoqi.called("ALMotion.setAngles"))
        robot.command_positions({"HeadPitch": 0.2}, {"HeadPitch": 1.0})
        with pytest.raises(InvalidCommand, match="the robot was lost"):
            robot.walker.command(WalkVelocity(forward=0.05))
        assert robot.walker.commanded() == STILL
        assert robot.read().commands[0] == setpoint
        assert len(naoqi.called("ALMotion.setAngles")) == sent
        assert naoqi.called("ALMotion.move") == []
        with pytest.raises(HardwareFailure, match="not connected"):
            robot.capture("Camera", 320, 240)


def test_nothing_that_was_commanded_before_is_sent_after_it_was_found(naoqi):
    naoqi.held.add("ALMotion.setAngles")
    with naoqi.robot() as robot:
        robot.command_positions({"HeadYaw": 0.5}, {"HeadYaw": 1.0})
        robot.command_positions({"HeadYaw": 0.7}, {"HeadYaw": 1.0})
        naoqi.lose()
        eventually(lambda: robot._connection._link is None)
        naoqi.reachable = True
        eventually(lambda: robot._connection.link is not None)
        eventually(lambda: robot._commands.orders.idle)
        assert len(naoqi.called("ALMotion.setAngles")) == 1
        assert len(naoqi.called("ALMotion.stopMove")) == 2, "a walk of before the loss is ended"


def test_a_camera_is_subscribed_again_when_it_was_found(naoqi):
    stamps = iter(range(1, 1000))
    naoqi.answers["ALVideoDevice.getImageRemote"] = lambda _handle: (
        *(320, 240, 3, 11, next(stamps), 0),
        bytearray(320 * 240 * 3),
    )
    with naoqi.robot() as robot:
        robot.capture("Camera", 320, 240)
        naoqi.lose()
        eventually(lambda: robot._connection._link is None)
        naoqi.reachable = True
        eventually(lambda: robot._connection.link is not None)
        robot.capture("Camera", 320, 240)
        assert len(naoqi.called("ALVideoDevice.subscribeCamera")) == 2


def test_what_fails_again_and_again_is_reported_once(naoqi, caplog):
    def fail(_keys):
        raise CallFailed("ALMemory::getListData: out of memory")

    with naoqi.robot() as robot:
        naoqi.answers[STATE] = fail
        count = len(naoqi.called(STATE))
        eventually(lambda: len(naoqi.called(STATE)) > count + 3)
        assert robot.read().positions, "the newest reading stays"
    assert caplog.text.count("out of memory") == 1


def test_a_question_that_fails_is_asked_again_later_and_the_others_go_on(naoqi, caplog):
    def fail():
        raise CallFailed("ALRobotPosture::getPosture: not now")

    naoqi.answers["ALRobotPosture.getPosture"] = fail
    with naoqi.robot():
        eventually(lambda: "not now" in caplog.text)
        count = len(naoqi.called("ALMotion.getRobotPosition"))
        eventually(lambda: len(naoqi.called("ALMotion.getRobotPosition")) > count)
        assert len(naoqi.called("ALRobotPosture.getPosture")) == 1
