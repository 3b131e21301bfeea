"""Lights, voice and postures over NAOqi."""

import pytest

from naoserver.errors import CommandRefused
from naoserver.naoqi._link import CallFailed
from tests.support.robot_server import eventually
from tests.support.scripted_naoqi import ScriptedNaoqi

SAY, GO, STOP = "ALTextToSpeech.say", "ALRobotPosture.goToPosture", "ALRobotPosture.stopMove"


@pytest.fixture
def naoqi():
    return ScriptedNaoqi()


def test_colored_lights_fade_in_color_and_others_in_brightness(naoqi):
    with naoqi.robot() as robot:
        robot.lights.set("LeftEye", (1.0, 0.5, 0.0), 0.5)
        robot.lights.set("RightEar", (0.2, 0.7, 0.1), 0.0)
        assert naoqi.called("ALLeds.fadeRGB") == [("LeftFaceLeds", 0xFF8000, 0.5)]
        assert naoqi.called("ALLeds.fade") == [("RightEarLeds", 0.7, 0.0)]
        assert robot.lights.colors()["RightEar"] == (0.0, 0.0, 0.7)


def test_texts_are_said_one_after_the_other(naoqi):
    naoqi.held.add(SAY)
    with naoqi.robot() as robot:
        robot.voice.say("one")
        robot.voice.say("two")
        assert naoqi.called(SAY) == [("one",)]
        assert robot.voice.utterance().text == "one"
        naoqi.let_go(SAY)
        eventually(lambda: not robot.voice.utterance().speaking)
        assert naoqi.called(SAY) == [("one",), ("two",)]
        assert robot.voice.utterance().count == 2


def test_silence_forgets_what_was_not_said(naoqi):
    naoqi.held.add(SAY)
    naoqi.answers["ALTextToSpeech.stopAll"] = lambda: naoqi.let_go(SAY)
    with naoqi.robot() as robot:
        robot.voice.say("one")
        robot.voice.say("two")
        robot.voice.stop()
        eventually(lambda: not robot.voice.utterance().speaking)
    assert naoqi.called(SAY) == [("one",)]


def test_a_posture_is_on_its_way_until_it_is_reached(naoqi):
    naoqi.held.add(GO)
    with naoqi.robot() as robot:
        assert robot.postures.names == ("Stand", "Crouch")
        robot.postures.go("Crouch", 0.5)
        assert naoqi.called(GO) == [("Crouch", 0.5)]
        assert robot.postures.progress().moving
        naoqi.let_go(GO)
        eventually(lambda: not robot.postures.progress().moving)
        assert robot.postures.progress().reached


def test_a_posture_that_is_not_reached_says_why(naoqi):
    def fail(*_arguments):
        raise CallFailed("ALRobotPosture::goToPosture: it lies on its side")

    naoqi.answers[GO] = fail
    with naoqi.robot() as robot:
        robot.postures.go("Stand", 0.5)
        eventually(lambda: "on its side" in robot.postures.progress().message)
        assert not robot.postures.progress().reached


def test_a_posture_that_was_stopped_says_so(naoqi):
    naoqi.held.add(GO)
    naoqi.answers[GO] = False
    naoqi.answers[STOP] = lambda: naoqi.let_go(GO)
    with naoqi.robot() as robot:
        robot.postures.go("Stand", 0.5)
        robot.postures.stop()
        eventually(lambda: robot.postures.progress().message == "it was stopped")


def test_a_stop_that_does_not_end_the_way_into_a_posture_is_repeated(naoqi, caplog):
    def end_at_the_third():
        if len(naoqi.called(STOP)) == 1:
            raise CallFailed("ALRobotPosture::stopMove: busy")
        if len(naoqi.called(STOP)) == 3:
            naoqi.let_go(GO)

    naoqi.held.add(GO)
    naoqi.answers[GO] = False
    with naoqi.robot() as robot:
        naoqi.calls.clear()
        naoqi.answers[STOP] = end_at_the_third
        robot.postures.go("Stand", 0.5)
        robot.postures.stop()
        eventually(lambda: robot.postures.progress().message == "it was stopped")
    assert len(naoqi.called(STOP)) == 3
    assert "goes on into a posture though it was stopped" in caplog.text


def test_a_way_into_a_posture_of_before_is_ended_each_time_the_robot_is_found(naoqi):
    naoqi.held.add(GO)
    with naoqi.robot() as robot:
        operations = [operation for operation, *_ in naoqi.calls]
        assert operations.index(STOP) < operations.index("ALAutonomousLife.getState")
        robot.postures.go("Stand", 0.5)
        naoqi.lose()
        eventually(lambda: "lost" in robot.postures.progress().message)
        naoqi.reachable = True
        eventually(lambda: len(naoqi.called(STOP)) == 2)


def test_a_robot_that_does_not_end_a_way_of_before_is_not_served(naoqi):
    def refuse():
        raise CallFailed("ALRobotPosture::stopMove: busy")

    naoqi.answers[STOP] = refuse
    with pytest.raises(CallFailed, match="stopMove: busy"), naoqi.robot():
        pass


def flood(lights):
    for _ in range(1000):
        lights.set("LeftEye", (1.0, 1.0, 1.0), 0.0)


def test_a_stop_waits_for_no_unanswered_call(naoqi):
    naoqi.held.update((GO, SAY, "ALLeds.fadeRGB"))
    with naoqi.robot() as robot:
        naoqi.calls.clear()
        robot.postures.go("Stand", 0.5)
        robot.voice.say("one")
        with pytest.raises(CommandRefused, match="has not answered"):
            flood(robot.lights)
        robot.postures.stop()
        robot.voice.stop()
        assert naoqi.called(STOP) == naoqi.called("ALTextToSpeech.stopAll") == [()]


@pytest.mark.parametrize(("reported", "posture"), [("Stand", "Stand"), ("Unknown", ""), ("Frog", "")])
def test_the_posture_is_one_that_is_known_or_none(naoqi, reported, posture):
    naoqi.answers["ALRobotPosture.getPosture"] = reported
    with naoqi.robot() as robot:
        naoqi.wait_for_call("ALRobotPosture.getPosture", 2)
        assert robot.postures.current() == posture


def test_a_robot_that_is_lost_refuses_to_shine_to_speak_and_to_move(naoqi):
    with naoqi.robot() as robot:
        naoqi.lose()
        for command in (
            lambda: robot.lights.set("LeftEye", (1.0, 0.0, 0.0), 0.0),
            robot.lights.reset,
            lambda: robot.voice.say("hello"),
            lambda: robot.postures.go("Stand", 0.5),
        ):
            with pytest.raises(CommandRefused, match="not connected"):
                command()
