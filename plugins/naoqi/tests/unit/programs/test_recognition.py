"""ALSpeechRecognition recognizes what is typed, over a fake robot in virtual time."""

import pytest

pytest.importorskip("qi")

from naoserver.errors import InvalidCommand
from visualhfsm_naoqi.programs._clients import Client, running
from visualhfsm_naoqi.programs._speech import ALSpeechRecognition

NOTHING = ["", -3.0]


@pytest.fixture
def recognition(rig):
    return rig.access.service(ALSpeechRecognition)


@pytest.fixture
def say(rig):
    return rig.access.hearing.hear


def test_a_phrase_of_the_vocabulary_is_recognized(memory, recognition, say):
    recognition.setVocabulary(["yes", "no", "go left"])
    recognition.subscribe("me")
    assert memory.getData("WordRecognized") == NOTHING
    assert say("  Go LEFT! ") == "go left"
    assert memory.getData("WordRecognized") == ["go left", 1.0]
    assert memory.getData("WordRecognizedAndGrammar") == ["go left", 1.0, "modifiable_grammar"]
    assert memory.getData("SpeechDetected") is False


@pytest.mark.parametrize("sentence", ["yes please", "yess", "left go", "?", "y e s"])
def test_a_sentence_that_is_no_phrase_is_not_recognized(memory, recognition, say, sentence):
    recognition.setVocabulary(["yes", "no", "go left"])
    recognition.subscribe("me")
    assert say(sentence) == ""
    assert memory.getData("WordRecognized") == NOTHING


def test_words_are_spotted_in_a_sentence_those_of_most_words_first(memory, recognition, say):
    recognition.setVocabulary(["ball", "left", "the red ball", "eft"], True)
    recognition.subscribe("me")
    assert say("Kick the red ball, then go left.") == "the red ball, ball, left"
    assert memory.getData("WordRecognized") == [
        *("<...> the red ball <...>", 1.0),
        *("<...> ball <...>", 1.0),
        *("<...> left <...>", 1.0),
    ]


@pytest.mark.parametrize(
    "change",
    [
        lambda recognition: recognition.unsubscribe("me"),
        lambda recognition: recognition.pause(True),
        lambda recognition: recognition.removeAllContext(),
        lambda recognition: recognition.setVocabulary(["no"]),
    ],
    ids=["unsubscribed", "paused", "without a vocabulary", "with another one"],
)
def test_it_recognizes_while_it_listens(memory, recognition, say, change):
    recognition.setVocabulary(["yes"])
    recognition.subscribe("me")
    change(recognition)
    assert say("yes") == ""
    assert memory.getData("WordRecognized") == NOTHING


def test_it_listens_again_after_a_pause(recognition, say):
    recognition.setWordListAsVocabulary(["yes"])
    recognition.subscribe("me")
    recognition.pause(True)
    recognition.pause(False)
    assert say("yes") == "yes"


def test_it_listens_no_more_for_a_lost_program(rig, recognition, say):
    recognition.setVocabulary(["yes"])
    client = Client("a program")
    call = rig.arrive(recognition.subscribe, client=client)
    with running(call):
        recognition.subscribe("me")
    assert say("yes") == "yes"
    rig.access.lose(client)
    assert say("yes") == ""


@pytest.mark.parametrize("vocabulary", [["yes", 7], ["yes", "?!"], 7, ["a" * 9999, "b" * 9999]])
def test_vocabularies_that_are_none(recognition, vocabulary):
    with pytest.raises(InvalidCommand, match="vocabulary"):
        recognition.setVocabulary(vocabulary)


def test_grammars_are_refused(recognition):
    with pytest.raises(InvalidCommand, match="only vocabularies: call setVocabulary"):
        recognition.compile("a.bnf", "a.lcf", "English")


def test_a_vocabulary_is_put_aside_and_comes_back(recognition, say):
    recognition.subscribe("me")
    recognition.setVocabulary(["yes"])
    recognition.pushContexts()
    assert say("yes") == ""
    recognition.setVocabulary(["stop"], True)
    recognition.pushContexts()
    recognition.setVocabulary(["left"])
    assert say("left") == "left"
    recognition.popContexts()
    assert say("please stop") == "stop"
    recognition.popContexts()
    assert say("yes") == "yes"
    assert say("please stop") == ""
    recognition.popContexts()
    assert say("yes") == "yes"  # nothing was left to come back


def test_it_recognizes_for_who_is_called_at_its_events(memory, recognition, say):
    recognition.setVocabulary(["yes"])
    memory.subscribeToEvent("WordRecognized", "Box", "onWord")
    memory.subscribeToEvent("SpeechDetected", "Box", "onSpeech")
    memory.unsubscribeToEvent("WordRecognized", "Box")
    assert say("yes") == "yes"
    memory.unsubscribeToEvent("SpeechDetected", "Box")
    assert say("yes") == ""
    assert recognition.getSubscribersInfo() == []
