"""What the robot says and plays comes over the network: it is bounded before the page gets it."""

from __future__ import annotations

from interfaces.nao import SoundState, SpeechState
from visualhfsm._monitor.realm.robot import audible


def test_what_is_said_and_played_is_heard_until_it_ends() -> None:
    assert audible(None, None) == ("", "")
    assert audible(SpeechState(speaking=True, text="Goal!"), SoundState(playing=True, name="beep")) == (
        "Goal!",
        "beep",
    )
    assert audible(SpeechState(text="Goal!"), SoundState(name="beep")) == ("", "")


def test_long_texts_are_cut_to_one_line() -> None:
    says, sound = audible(
        SpeechState(speaking=True, text="one\ntwo" + "x" * 9000), SoundState(playing=True, name="y" * 9000)
    )
    assert says.startswith("one two")
    assert len(says) <= 2000
    assert len(sound) <= 100
