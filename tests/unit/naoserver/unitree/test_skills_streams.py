"""The streams of sound of the G1's voice service, in virtual time and without DDS."""

from __future__ import annotations

import json

import pytest

from naoserver._programs import Programs
from naoserver.assembly import Assembly
from naoserver.bodies import find_body
from naoserver.expression import SOUNDS
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.unitree._loco import CODES, NOT_AVAILABLE, NOT_IMPLEMENTED, WRONG_PARAMETER
from naoserver.unitree._skills import Streams
from zenoh_ice import VirtualClock

SECOND = bytes(2 * 16_000)


class Rig:
    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.robot = FakeRobot(self.clock, body=find_body("G1"))
        self.assembly = Assembly(self.robot, ServerOptions(), self.clock)
        self.programs = Programs(self.robot, self.assembly, "Unitree", CODES)
        self.streams = Streams(self.programs)

    def play(self, samples: bytes, app: object = "example") -> int:
        parameter = json.dumps({"app_name": app, "stream_id": "1"})
        self.streams.samples = samples
        return self.programs.answer(self.streams.operations, 1003, parameter, "program")[0]

    def end(self, app: str = "example") -> int:
        parameter = json.dumps({"app_name": app})
        return self.programs.answer(self.streams.operations, 1004, parameter, "program")[0]

    @property
    def playing(self) -> str:
        assert self.robot.loudspeaker is not None
        now = self.robot.loudspeaker.playback()
        return now.name if now.playing else ""

    def events(self) -> list[str]:
        return [event.message for event in self.assembly.events.snapshot()[0]]


@pytest.fixture
def rig():
    rig = Rig()
    yield rig
    rig.robot.close()


def test_it_plays_as_long_as_its_samples_which_come_ahead(rig):
    """The maker's g1_audio_client_play_wav.py sends 3 s each second."""
    for _ in range(2):
        assert rig.play(3 * SECOND) == 0
        rig.clock.advance(1.0)
    rig.clock.advance(4.7)
    assert rig.playing == "example"
    rig.clock.advance(0.1)
    assert rig.playing == ""


def test_its_samples_are_what_is_played(rig):
    rig.play(b"\1\2" * 4000)
    rig.clock.advance(0.5)
    assert rig.robot.loudspeaker.playback().samples == b"\1\2" * 4000


def test_its_program_ends_it(rig):
    rig.play(3 * SECOND)
    rig.clock.advance(1.0)
    assert rig.end() == 0
    assert rig.playing == ""


def test_after_its_end_a_new_one_begins(rig):
    rig.play(2 * SECOND)
    rig.clock.advance(5.0)
    rig.play(SECOND)
    rig.clock.advance(0.5)
    assert rig.playing == "example"


def test_what_ends_a_stream_ends_no_sound_of_others(rig):
    rig.play(SECOND, "beep")
    rig.robot.loudspeaker.play(SOUNDS["beep"], 1.0)
    rig.end("beep")
    rig.assembly.gate.stop("a test")
    assert rig.playing == "beep"


def test_the_stream_of_another_program_takes_its_place(rig):
    rig.play(3 * SECOND)
    rig.play(SECOND, "another")
    assert rig.playing == "another"
    assert rig.end("example") == 0
    assert rig.playing == "another"


def test_an_emergency_stop_silences_it_and_what_comes_after_it(rig):
    rig.play(3 * SECOND)
    rig.assembly.gate.stop("a test")
    assert rig.playing == ""
    assert rig.play(SECOND) == NOT_AVAILABLE
    assert rig.playing == ""


def test_a_stop_while_it_begins_silences_it(rig, monkeypatch):
    begin = rig.robot.loudspeaker.play_samples

    def begun_after_a_stop(*arguments):
        rig.assembly.gate.stop("in between")
        return begin(*arguments)

    monkeypatch.setattr(rig.robot.loudspeaker, "play_samples", begun_after_a_stop)
    rig.play(SECOND)
    assert rig.playing == ""


@pytest.mark.parametrize(
    ("samples", "app"),
    [(SECOND[:-1], "example"), (SECOND, ""), (SECOND, 101 * "a"), (SECOND, 7), (251 * SECOND, "example")],
    ids=["half a sample", "no name", "a long name", "a number", "too long"],
)
def test_what_is_no_stream_is_refused(rig, samples, app):
    assert rig.play(samples, app) == WRONG_PARAMETER
    assert rig.playing == ""


def test_a_robot_without_loudspeaker_says_so(rig, monkeypatch):
    monkeypatch.setattr(rig.robot, "loudspeaker", None)
    rig.streams = Streams(rig.programs)
    assert rig.play(SECOND) == NOT_IMPLEMENTED
    assert rig.events()[-1].endswith("this robot has no loudspeaker")
