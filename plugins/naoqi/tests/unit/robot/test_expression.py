"""Lights, voice, sounds and postures over NAOqi."""

import pytest

from naoserver.bodies.capabilities import Sound, Tone
from naoserver.errors import CommandRefused
from naoserver.hardware.connection import CallFailed
from naoserver.protocol.expression import SOUNDS, single_tone
from plugins.naoqi.tests.support.scripted import ScriptedNaoqi
from tests.support.robot_server import eventually

SAY, GO, STOP = "ALTextToSpeech.say", "ALRobotPosture.goToPosture", "ALRobotPosture.stopMove"
PLAY, SILENCE = "ALAudioPlayer.playSine", "ALAudioPlayer.stopAll"


@pytest.fixture
def naoqi():
    return ScriptedNaoqi(speed=4.0)


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


def test_a_stop_that_comes_before_the_text_is_repeated(naoqi):
    stops = []

    def stop():
        stops.append("stop")
        if len(stops) > 1:
            naoqi.let_go(SAY)

    naoqi.held.add(SAY)
    naoqi.answers["ALTextToSpeech.stopAll"] = stop
    with naoqi.robot() as robot:
        robot.voice.say("one")
        robot.voice.stop()
        eventually(lambda: not robot.voice.utterance().speaking)
    assert len(stops) == 2


def test_the_tones_of_a_sound_are_played_one_after_the_other_with_its_rests(naoqi):
    naoqi.held.add(PLAY)
    with naoqi.robot() as robot:
        robot.loudspeaker.play(Sound("two", (Tone(440.4, 0.05), Tone(0, 0.05), Tone(880, 0.1))), 0.256)
        naoqi.wait_for_call("ALMemory.getListData", 3)
        assert naoqi.called(PLAY) == [(440, 26, 0, 0.05)]
        assert robot.loudspeaker.playback().playing
        naoqi.let_go(PLAY)
        naoqi.wait_for_call(PLAY, 2)
        eventually(lambda: not robot.loudspeaker.playback().playing)
        assert naoqi.called(PLAY) == [(440, 26, 0, 0.05), (880, 26, 0, 0.1)]
        assert naoqi.called(SILENCE) == []


def test_a_tone_that_naoqi_answers_at_once_still_takes_its_time(naoqi):
    with naoqi.robot() as robot:
        begun = robot.clock.now()
        robot.loudspeaker.play(single_tone(440.0, 0.3), 0.5)
        eventually(lambda: not robot.loudspeaker.playback().playing)
        assert robot.clock.now() - begun >= 0.3


def test_a_sound_begins_after_the_end_of_the_one_that_it_replaces(naoqi):
    naoqi.held.update((PLAY, SILENCE))
    with naoqi.robot() as robot:
        robot.loudspeaker.play(SOUNDS["fanfare"], 0.5)
        robot.loudspeaker.play(single_tone(440.0, 0.1), 1.0)
        assert robot.loudspeaker.playback().count == 2
        assert len(naoqi.called(PLAY)) == len(naoqi.called(SILENCE)) == 1
        naoqi.let_go(PLAY)  # the tone has ended, but the stop might still come
        naoqi.wait_for_call("ALMemory.getListData", len(naoqi.called("ALMemory.getListData")) + 3)
        assert len(naoqi.called(PLAY)) == 1
        naoqi.let_go(SILENCE)
        eventually(lambda: not robot.loudspeaker.playback().playing)
        assert naoqi.called(PLAY)[1:] == [(440, 100, 0, 0.1)]


def test_a_stop_ends_the_sound_with_its_further_tones(naoqi):
    naoqi.held.add(PLAY)
    naoqi.answers[SILENCE] = lambda: naoqi.let_go(PLAY)
    with naoqi.robot() as robot:
        robot.loudspeaker.play(SOUNDS["fanfare"], 0.5)
        robot.loudspeaker.stop()
        eventually(lambda: not robot.loudspeaker.playback().playing)
    assert len(naoqi.called(PLAY)) == len(naoqi.called(SILENCE)) == 1


@pytest.mark.slow
def test_a_sound_ends_with_its_server_and_when_the_robot_is_lost(naoqi):
    naoqi.held.add(PLAY)
    with naoqi.robot() as robot:
        robot.loudspeaker.play(SOUNDS["fanfare"], 0.5)
        naoqi.lose()
        eventually(lambda: not robot.loudspeaker.playback().playing)
        robot.loudspeaker.stop()
        assert naoqi.called(SILENCE) == []
        naoqi.reachable = True
        naoqi.held.add(PLAY)

        def play_again():
            try:
                robot.loudspeaker.play(SOUNDS["fanfare"], 0.5)
            except CommandRefused:
                return False
            return True

        eventually(play_again)
    assert len(naoqi.called(SILENCE)) == 1
    assert len(naoqi.called(PLAY)) == 2


def test_a_tone_that_naoqi_refuses_is_reported_and_the_sound_ends(naoqi, caplog):
    def refuse(*_arguments):
        raise CallFailed("ALAudioPlayer::playSine: no sound card")

    naoqi.answers[PLAY] = refuse
    with naoqi.robot() as robot:
        robot.loudspeaker.play(SOUNDS["beep"], 0.5)
        eventually(lambda: not robot.loudspeaker.playback().playing)
    assert "no sound card" in caplog.text


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


@pytest.mark.slow
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


@pytest.mark.slow
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


def test_a_robot_that_is_lost_refuses_to_shine_to_speak_to_sound_and_to_move(naoqi):
    with naoqi.robot() as robot:
        naoqi.lose()
        for command in (
            lambda: robot.lights.set("LeftEye", (1.0, 0.0, 0.0), 0.0),
            robot.lights.reset,
            lambda: robot.voice.say("hello"),
            lambda: robot.loudspeaker.play(SOUNDS["beep"], 0.5),
            lambda: robot.postures.go("Stand", 0.5),
        ):
            with pytest.raises(CommandRefused, match="not connected"):
                command()


def test_a_loudspeaker_of_naoqi_plays_tones_alone(naoqi):
    with naoqi.robot() as robot, pytest.raises(CommandRefused, match="plays tones, not samples"):
        robot.loudspeaker.play_samples("song", b"12")
