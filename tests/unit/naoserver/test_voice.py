"""A voice that takes its time."""

import pytest

from naoserver.capabilities import Utterance
from naoserver.errors import InvalidCommand
from naoserver.expression import MOST_WAITING, TimedVoice, speaking_time
from zenoh_ice import VirtualClock

HELLO, LONGER = "Hello", "I am a robot, and I have much to say."


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def voice(clock):
    return TimedVoice(clock.now)


def test_it_is_silent_at_first(voice):
    assert voice.utterance() == Utterance()


def test_a_text_takes_as_long_as_it_is(voice, clock):
    assert speaking_time(LONGER) > speaking_time(HELLO) > 0.0
    voice.say(HELLO)
    clock.advance(speaking_time(HELLO) - 0.01)
    assert voice.utterance() == Utterance(HELLO, speaking=True, count=1)
    clock.advance(0.02)
    assert voice.utterance() == Utterance(HELLO, speaking=False, count=1)


def test_texts_are_said_one_after_the_other(voice, clock):
    voice.say(HELLO)
    voice.say(LONGER)
    assert voice.utterance().text == HELLO
    clock.advance(speaking_time(HELLO) + 0.01)
    assert voice.utterance() == Utterance(LONGER, speaking=True, count=2)
    clock.advance(speaking_time(LONGER))
    assert voice.utterance() == Utterance(LONGER, speaking=False, count=2)


def test_after_a_silence_a_text_begins_at_once(voice, clock):
    voice.say(HELLO)
    clock.advance(60.0)
    voice.say(LONGER)
    clock.advance(speaking_time(LONGER) - 0.01)
    assert voice.utterance().speaking


def test_a_stop_silences_it_and_forgets_what_waits(voice, clock):
    voice.say(HELLO)
    voice.say(LONGER)
    voice.stop()
    voice.stop()
    assert voice.utterance() == Utterance(HELLO, speaking=False, count=1)
    clock.advance(60.0)
    assert voice.utterance().count == 1


def test_what_waits_is_bounded(voice, clock):
    for _ in range(MOST_WAITING + 1):
        voice.say(HELLO)
    with pytest.raises(InvalidCommand, match="wait"):
        voice.say(HELLO)
    clock.advance(speaking_time(HELLO) + 0.01)
    voice.say(HELLO)
