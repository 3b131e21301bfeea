"""Lights that fade over the robot's time, and a voice and sounds that take their time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from naoserver.capabilities import Playback, Utterance
from naoserver.errors import InvalidCommand
from naoserver.expression import (
    MOST_WAITING,
    SOUNDS,
    FadingLights,
    TimedSounds,
    TimedVoice,
    speaking_time,
)
from zenoh_ice import VirtualClock

RED, BLACK = (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
HELLO, LONGER = "Hello", "I am a robot, and I have much to say."
part = st.floats(0.0, 1.0)
START = {name: lamp.start for name, lamp in H25.lights.items()}
SINGLE_COLORED = [name for name, lamp in H25.lights.items() if lamp.single_colored]


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def lights(clock):
    return FadingLights(clock.now, H25.lights)


def test_it_starts_with_the_lights_of_the_start_and_returns_to_them(lights):
    assert lights.colors() == START
    for name in lights.names:
        lights.set(name, (0.2, 0.4, 0.3), 0.0)
    lights.reset()
    assert lights.colors() == START


def test_a_group_takes_a_color_at_once_and_the_others_keep_theirs(lights):
    lights.set("Chest", RED, 0.0)
    assert lights.colors() == START | {"Chest": RED}


def test_a_fade_goes_evenly_and_stays_at_its_end(lights, clock):
    lights.set("Chest", RED, 2.0)
    seen = []
    for _ in range(5):
        seen.append(lights.colors()["Chest"][0])
        clock.advance(0.5)
    assert seen == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    clock.advance(10.0)
    assert lights.colors()["Chest"] == RED


def test_a_new_fade_begins_where_the_one_before_was(lights, clock):
    lights.set("Chest", RED, 2.0)
    clock.advance(1.0)
    lights.set("Chest", BLACK, 1.0)
    clock.advance(0.5)
    assert lights.colors()["Chest"] == pytest.approx((0.25, 0.0, 0.0))


@given(st.sampled_from(SINGLE_COLORED), part, part, part)
def test_of_a_group_with_one_color_only_the_brightest_part_counts(name, red, green, blue):
    lights = FadingLights(lambda: 0.0, H25.lights)
    lights.set(name, (red, green, blue), 0.0)
    assert lights.colors()[name] == (0.0, 0.0, max(red, green, blue))


@given(part, part, st.floats(0.0, 60.0), st.floats(0.0, 100.0))
def test_no_color_leaves_the_way_from_one_to_the_other(before, after, seconds, later):
    now = 0.0
    lights = FadingLights(lambda: now, H25.lights)
    lights.set("Chest", (before, 0.0, 0.0), 0.0)
    lights.set("Chest", (after, 0.0, 0.0), seconds)
    now = later
    assert min(before, after) - 1e-9 <= lights.colors()["Chest"][0] <= max(before, after) + 1e-9


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


BEEP, FANFARE = SOUNDS["beep"], SOUNDS["fanfare"]


def played(sound, loudness, count, *, playing):
    return Playback(sound.name, sound.tones, loudness, playing, count)


@pytest.fixture
def sounds(clock):
    return TimedSounds(clock.now)


def test_a_sound_takes_as_long_as_its_tones(sounds, clock):
    assert sounds.playback() == Playback()
    sounds.play(FANFARE, 0.5)
    clock.advance(FANFARE.duration - 0.01)
    assert sounds.playback() == played(FANFARE, 0.5, 1, playing=True)
    clock.advance(0.02)
    assert sounds.playback() == played(FANFARE, 0.5, 1, playing=False)


def test_a_sound_ends_the_one_before(sounds, clock):
    sounds.play(FANFARE, 0.5)
    sounds.play(BEEP, 1.0)
    assert sounds.playback() == played(BEEP, 1.0, 2, playing=True)
    clock.advance(BEEP.duration + 0.01)
    assert sounds.playback() == played(BEEP, 1.0, 2, playing=False)


def test_a_stop_ends_the_sound(sounds, clock):
    sounds.play(FANFARE, 0.5)
    sounds.stop()
    sounds.stop()
    assert sounds.playback() == played(FANFARE, 0.5, 1, playing=False)
