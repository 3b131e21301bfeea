"""What the robot says and plays comes over the network: it is bounded before the page gets it."""

from __future__ import annotations

import math

from interfaces.nao import SoundState, SpeechState, Tone
from visualhfsm._monitor.realm.audible import Audible, Begin, audible


def speech(text: str, *, speaking: bool = True) -> SpeechState:
    return SpeechState(time=1.0, speaking=speaking, text=text, count=3)


def sound(*tones: tuple[float, float], loudness: float = 0.5, playing: bool = True) -> SoundState:
    return SoundState(
        time=1.0,
        playing=playing,
        name="beep",
        loudness=loudness,
        tones=[Tone(frequency=frequency, seconds=seconds) for frequency, seconds in tones],
        count=4,
    )


def test_what_is_said_and_played_is_heard_and_silence_keeps_the_counts() -> None:
    assert audible(None, None) == Audible()
    heard = audible(speech("Goal!"), sound((440.0, 0.5), (0.0, 0.1)))
    assert heard == Audible("Goal!", "beep", ((440.0, 0.5), (0.0, 0.1)), 0.5, (3, 4))
    silent = audible(speech("Goal!", speaking=False), sound((440.0, 0.5), playing=False))
    assert silent == Audible(counts=(3, 4))


def test_long_texts_are_cut_to_one_line() -> None:
    says = audible(speech("one\ntwo" + "x" * 9000), None).says
    assert says.startswith("one two")
    assert len(says) <= 2000


def test_tones_that_no_robot_plays_are_left_out() -> None:
    strange = [
        (math.nan, 1.0),
        (math.inf, 1.0),
        (49.0, 1.0),
        (8001.0, 1.0),
        (-440.0, 1.0),
        (440.0, math.nan),
        (440.0, math.inf),
        (440.0, 10.5),
        (440.0, 0.0),
        (440.0, -1.0),
    ]
    assert audible(None, sound(*strange, (50.0, 10.0), (8000.0, 0.1))).tones == ((50.0, 10.0), (8000.0, 0.1))


def test_of_a_sound_without_end_the_first_tones_are_heard() -> None:
    assert len(audible(None, sound(*[(440.0, 0.1)] * 1000)).tones) == 64


def test_the_loudness_is_between_0_and_1() -> None:
    given = (-1.0, 7.0, math.nan, math.inf)
    assert [audible(None, sound(loudness=each)).loudness for each in given] == [0.0, 1.0, 0.0, 0.0]


def test_the_age_of_a_sound_is_known_if_its_begin_was_watched() -> None:
    now = 0.0
    begin = Begin(lambda: now)
    begin.observe(None)
    begin.observe(3)
    assert begin.age is None  # it began before anybody looked
    now = 0.5
    begin.observe(4)
    now = 2.0
    begin.observe(4)
    assert begin.age == 1.5


def test_the_age_of_what_began_while_nobody_looked_is_unknown() -> None:
    now = 0.0
    begin = Begin(lambda: now)
    begin.observe(3)
    now = 60.0
    begin.observe(4)
    assert begin.age is None
