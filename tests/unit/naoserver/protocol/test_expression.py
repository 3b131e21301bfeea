"""Lights that fade over the robot's time, and a voice and sounds that take their time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.bodies.capabilities import Playback, Utterance
from naoserver.bodies.nao import H25
from naoserver.errors import InvalidCommand
from naoserver.protocol.expression import (
    MOST_BYTES,
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


SECOND = bytes(range(250)) * 128
"""A second of samples: 32000 bytes."""


def heard(sounds, clock, seconds):
    """Return what a server streams: each block once, as it is when it is due."""
    found: dict[tuple[int, int], bytes] = {}
    for _ in range(round(seconds / 0.02)):
        clock.advance(0.02)
        now = sounds.playback()
        if now.place >= 0:
            found.setdefault((now.count, now.place), now.samples)
    return found


def whole(found):
    """Return samples that follow one another."""
    joined = b""
    for (_, place), samples in found.items():
        assert 2 * place == len(joined) or not samples
        joined += samples
    return joined


def test_samples_are_due_one_after_the_other_and_whole(sounds, clock):
    assert sounds.play_samples("song", SECOND) == 1
    assert sounds.play_samples("song", SECOND[:1000]) == 1
    assert whole(heard(sounds, clock, 3.0)) == SECOND + SECOND[:1000]
    assert sounds.playback() == Playback("song", (), 1.0, playing=False, count=1)


def test_a_program_that_sends_what_it_hears_is_heard_whole(sounds, clock):
    clock.call_every(0.1, lambda: sounds.play_samples("song", SECOND[:3200]))
    assert whole(heard(sounds, clock, 2.0)).startswith(SECOND[:3200] * 10)


def test_a_program_that_is_late_goes_on_after_silence(sounds, clock):
    sounds.play_samples("song", SECOND[:12_000])
    early = heard(sounds, clock, 0.8)
    assert early == {(1, 0): SECOND[:8000], (1, 4000): SECOND[8000:12_000]}
    assert sounds.play_samples("song", SECOND[:8000]) == 1
    assert (heard(sounds, clock, 0.5) | early) == early | {(1, 8000): SECOND[:8000], (1, 12_000): b""}


@pytest.mark.parametrize("begin", ["a tone", "a stop", "another song"])
def test_samples_end_for_another_sound_and_at_a_stop(sounds, clock, begin):
    sounds.play_samples("song", 5 * SECOND)
    assert heard(sounds, clock, 1.0)
    if begin == "a tone":
        sounds.play(BEEP, 1.0)
    elif begin == "a stop":
        sounds.stop()
    else:
        sounds.play_samples("another", SECOND[:2])
    assert {count for count, _ in heard(sounds, clock, 1.0)} <= {2}
    assert sounds.playback().playing is False


def test_samples_after_their_end_are_another_sound(sounds, clock):
    sounds.play_samples("song", SECOND)
    clock.advance(3.0)
    assert sounds.play_samples("song", SECOND) == 2
    assert whole(heard(sounds, clock, 3.0)) == SECOND


@pytest.mark.parametrize("samples", [b"1", bytes(MOST_BYTES), bytes(MOST_BYTES - 31_999)])
def test_half_a_sample_and_more_than_may_wait_change_nothing(sounds, clock, samples):
    sounds.play_samples("song", SECOND)
    with pytest.raises(InvalidCommand, match="2 bytes each, and at most 8000000 bytes wait"):
        sounds.play_samples("song", samples)
    with pytest.raises(InvalidCommand, match="2 bytes each"):
        sounds.play_samples("another", b"1")
    assert whole(heard(sounds, clock, 3.0)) == SECOND


def test_samples_without_listeners_leave_no_more_than_those_that_wait(sounds, clock):
    begun = 0
    for _ in range(400):
        begun = sounds.play_samples("song", SECOND)
        clock.advance(1.0)
    assert begun == 1
    with pytest.raises(InvalidCommand):
        sounds.play_samples("song", bytes(MOST_BYTES))
    sounds.play_samples("song", bytes(MOST_BYTES - 32_000))
