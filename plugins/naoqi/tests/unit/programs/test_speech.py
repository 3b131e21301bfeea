"""ALTextToSpeech and ALAnimatedSpeech over a fake robot, in virtual time."""

import pytest

pytest.importorskip("qi")

from naoserver.errors import InvalidCommand
from visualhfsm_naoqi.programs._speech import ALAnimatedSpeech, ALTextToSpeech


@pytest.fixture
def speech(rig):
    return rig.access.service(ALTextToSpeech)


def test_a_text_is_said_without_its_tags(rig, memory, speech):
    rig.complete(speech.say, "Hello \\pau=300\\ you")
    assert rig.robot.voice.utterance().text == "Hello   you"
    assert memory.getData("ALTextToSpeech/TextDone") == 1


def test_animations_are_left_out(rig):
    rig.complete(rig.access.service(ALAnimatedSpeech).say, "^start(animations/Stand/Gestures/Hey_1) Hey")
    assert rig.robot.voice.utterance().text == "Hey"


def test_stop_all_ends_what_is_being_said(rig, speech):
    call = rig.begin(speech.say, "a long text " * 20)
    speech.stopAll()
    rig.advance(0.2)
    call.join()


def test_stop_all_forgets_what_was_not_begun_yet(rig, speech):
    late = rig.arrive(speech.say, "a long text " * 20)
    speech.stopAll()
    speech.say(late, "a long text " * 20)
    assert rig.robot.voice.utterance().count == 0
    rig.complete(speech.say, "Hello")
    assert rig.robot.voice.utterance().text == "Hello"


def test_a_voice_goes_with_its_language(speech):
    speech.setVoice("naofrf")
    assert (speech.getLanguage(), speech.getVoice()) == ("French", "naofrf")
    with pytest.raises(InvalidCommand, match="no voice 'Nobody'; there are naoenu"):
        speech.setVoice("Nobody")


def test_parameters_of_the_voice_are_remembered(speech):
    speech.setParameter("speed", 80)
    assert (speech.getParameter("speed"), speech.getParameter("pitchShift")) == (80.0, 0.0)
    speech.resetSpeed()
    assert speech.getParameter("speed") == 0.0


def test_of_many_values_without_effect_the_newest_are_kept(speech):
    for i in range(1001):
        speech.setParameter(f"parameter {i}", i + 1)
    speech.setVolume(0.3)
    assert speech.getVolume() == 0.3
    assert [speech.getParameter(f"parameter {i}") for i in (1000, 0)] == [1001.0, 0.0]


def test_the_mode_of_body_language_is_remembered(rig):
    speech = rig.access.service(ALAnimatedSpeech)
    speech.setBodyLanguageMode(0)
    assert speech.getBodyLanguageMode() == 0
