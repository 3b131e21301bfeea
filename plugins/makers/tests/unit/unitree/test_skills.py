"""The operations of the G1's services of the arms, of sound and light, and of its modes, in virtual time."""

from __future__ import annotations

import json

import pytest

from naoserver.protocol.expression import LONGEST_TEXT, SOUNDS
from plugins.makers.tests.support.maker_rigs import MakerRig
from visualhfsm_makers._unitree import _skills
from visualhfsm_makers._unitree._loco import CODES, NOT_AVAILABLE, NOT_IMPLEMENTED, WRONG_PARAMETER
from visualhfsm_makers._unitree._skills import NO_ACTION, Streams

SECOND = bytes(2 * 16_000)
"""Of sound."""
WAVE, RELEASE = '{"data": 26}', '{"data": 99}'


class Rig(MakerRig):
    def __init__(self) -> None:
        super().__init__("G1", "Unitree", CODES)
        self.arm, self.voice = _skills.arm(self.programs), _skills.voice(self.programs)
        self.modes = _skills.ModeSwitch(self.programs).operations
        self.streams = Streams(self.programs)

    def call(self, service, operation, parameter="{}"):
        return self.programs.answer(service, operation, parameter, "program")

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


@pytest.fixture
def rig():
    rig = Rig()
    yield rig
    rig.robot.close()


def test_it_waves_until_it_is_released(rig):
    assert rig.call(rig.arm, 7106, WAVE) == (0, "")
    assert rig.assembly.moves_for("program")
    assert rig.call(rig.arm, 7106, RELEASE) == (0, "")
    assert not rig.assembly.moves_for("program")


def test_who_holds_the_lease_moves_the_arms(rig):
    rig.assembly.gate.acquire("behavior", "dance", 30.0)
    assert rig.call(rig.arm, 7106, WAVE)[0] == NOT_AVAILABLE


def test_it_says_a_text(rig):
    assert rig.call(rig.voice, 1001, '{"index": 0, "text": "Hello", "speaker_id": 1}') == (0, "")
    assert rig.robot.voice.utterance().text == "Hello"


def test_its_light_has_the_color(rig):
    assert rig.call(rig.voice, 1010, '{"R": 255, "G": 102, "B": 51}') == (0, "")
    assert rig.robot.lights.colors()["Head"] == pytest.approx((1.0, 0.4, 0.2))


def test_a_text_has_a_longest_length(rig):
    assert rig.call(rig.voice, 1001, json.dumps({"text": LONGEST_TEXT * "a"})) == (0, "")
    assert rig.call(rig.voice, 1001, json.dumps({"text": (LONGEST_TEXT + 1) * "a"}))[0] == WRONG_PARAMETER


@pytest.mark.parametrize(
    ("part", "call"),
    [("voice", (1001, '{"text": "Hello"}')), ("lights", (1010, '{"R": 255, "G": 0, "B": 51}'))],
)
def test_a_robot_says_which_part_it_lacks(rig, monkeypatch, part, call):
    monkeypatch.setattr(rig.robot, part, None)
    assert rig.call(_skills.voice(rig.programs), *call)[0] == NOT_IMPLEMENTED
    assert rig.events[-1].endswith(f": this robot has no {part}")


@pytest.mark.parametrize(
    ("service", "version"), [("arm", "1.0.0.14"), ("voice", "1.0.0.0"), ("modes", "1.0.0.1")]
)
def test_each_service_has_the_makers_version(rig, service, version):
    assert rig.call(getattr(rig, service), 1) == (0, version)


def test_a_program_takes_the_joints_and_gives_them_back(rig):
    rig.call(rig.arm, 7106, WAVE)
    assert json.loads(rig.call(rig.modes, 1001)[1])["name"] == "ai"
    assert rig.call(rig.modes, 1003) == (0, "")
    assert not rig.assembly.moves_for("program")
    assert json.loads(rig.call(rig.modes, 1001)[1])["name"] == ""
    assert rig.call(rig.modes, 1002, '{"name": "ai"}') == (0, "")
    assert json.loads(rig.call(rig.modes, 1001)[1])["name"] == "ai"


@pytest.mark.parametrize(
    ("service", "operation", "parameter", "code"),
    [
        ("arm", 7106, '{"data": 18}', NO_ACTION),
        ("arm", 7106, '{"data": 1e999}', WRONG_PARAMETER),
        ("arm", 7106, '{"data": 1e300}', NO_ACTION),
        ("arm", 7107, "{}", NOT_IMPLEMENTED),
        ("voice", 1001, '{"text": " "}', WRONG_PARAMETER),
        ("voice", 1005, "{}", NOT_IMPLEMENTED),
        ("voice", 1010, '{"R": 256, "G": 0, "B": 0}', WRONG_PARAMETER),
        ("modes", 1002, '{"name": "advanced"}', WRONG_PARAMETER),
    ],
)
def test_what_it_cannot_is_refused_by_the_makers_code(rig, service, operation, parameter, code):
    assert rig.call(getattr(rig, service), operation, parameter)[0] == code


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
    assert rig.events[-1].endswith("this robot has no loudspeaker")
