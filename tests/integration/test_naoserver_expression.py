"""Lights, voice and sounds as clients use them."""

import math
import random
from queue import Queue
from typing import cast

import pytest

from interfaces.jderobot import InvalidValueException
from interfaces.nao import LedColor, LedsPrx, Sounds, SoundSamples, SoundsPrx, SpeechPrx
from naoserver.bodies.nao import H25
from naoserver.fake import FakeRobot
from tests.support.limits import EVENT_LIMIT
from tests.support.robot_server import served_to_client, wait_for
from tests.support.waiting import until
from zenoh_ice import RobotClock

RED = LedColor(red=1.0, green=0.0, blue=0.0)


@pytest.fixture(scope="module")
def nao():
    with served_to_client(FakeRobot()) as nao:
        yield nao


@pytest.fixture
def leds(nao):
    leds = nao.proxy(LedsPrx, "Leds")
    leds.reset()
    return leds


@pytest.fixture
def speech(nao):
    speech = nao.proxy(SpeechPrx, "Speech")
    speech.stop()
    return speech


def test_lights_are_named_set_and_reported(leds):
    assert leds.getLedNames() == list(H25.lights)
    leds.setLed("LeftEye", RED, 0.0)
    assert leds.getLeds().colors["LeftEye"] == RED
    leds.reset()
    assert leds.getLeds().colors["LeftEye"] == LedColor(red=1.0, green=1.0, blue=1.0)


@pytest.mark.parametrize(
    ("field", "name", "color", "seconds"),
    [
        ("name", "Tail", RED, 0.0),
        ("red", "Chest", LedColor(red=1.1, green=0.0, blue=0.0), 0.0),
        ("green", "Chest", LedColor(red=0.0, green=math.nan, blue=0.0), 0.0),
        ("blue", "Chest", LedColor(red=0.0, green=0.0, blue=-0.1), 0.0),
        ("seconds", "Chest", RED, -1.0),
        ("seconds", "Chest", RED, 61.0),
        ("seconds", "Chest", RED, math.inf),
    ],
)
def test_what_no_light_can_show_is_refused_by_name(leds, field, name, color, seconds):
    before = leds.getLeds().colors
    with pytest.raises(InvalidValueException) as refusal:
        leds.setLed(name, color, seconds)
    assert refusal.value.field == field
    assert leds.getLeds().colors == before


def test_the_lights_stream_shows_a_fade_to_its_end(leds):
    leds.setLed("Chest", RED, 0.1)
    wait_for(leds.getLeds, lambda state: state.colors["Chest"] == RED)


def test_a_listener_that_comes_late_gets_what_does_not_change(nao, leds):
    leds.setLed("Chest", RED, 0.0)
    with nao.client() as first, nao.client() as second:
        for client in (first, second):
            sample = client.proxy(LedsPrx, "Leds").getLeds.wait(timeout=EVENT_LIMIT)
            assert sample.value.colors["Chest"] == RED


def test_a_text_is_said_and_reported_and_silenced(speech):
    speech.say("A text that takes quite some time to be said, even by somebody in a great hurry. " * 10)
    said = wait_for(speech.getSpeech, lambda state: state.speaking)
    assert said.text.startswith("A text")
    speech.stop()
    silent = wait_for(speech.getSpeech, lambda state: not state.speaking)
    assert silent.count == said.count == speech.getSpeech().count


@pytest.mark.parametrize("text", ["", " \n", "x" * 2001])
def test_what_cannot_be_said_is_refused(speech, text):
    with pytest.raises(InvalidValueException) as refusal:
        speech.say(text)
    assert refusal.value.field == "text"


@pytest.fixture
def sounds(nao):
    sounds = nao.proxy(SoundsPrx, "Sounds")
    sounds.stop()
    return sounds


def test_sounds_have_a_line_for_people_and_a_length(sounds):
    assert all(facts.description and 0.1 < facts.duration < 3.0 for facts in sounds.getSounds())


def test_a_sound_is_played_to_its_end(sounds):
    beep = next(facts for facts in sounds.getSounds() if facts.name == "beep")
    count = sounds.getSound().count
    sounds.play("beep", 0.4)
    begun = wait_for(sounds.getSound, lambda state: state.count == count + 1)
    assert sum(tone.seconds for tone in begun.tones) == beep.duration
    ended = wait_for(sounds.getSound, lambda state: not state.playing)
    assert (ended.name, ended.loudness, ended.count) == ("beep", 0.4, begun.count)


def test_a_tone_is_played_and_silenced(sounds):
    sounds.playTone(440.0, 10.0, 1.0)
    begun = wait_for(sounds.getSound, lambda state: state.playing)
    sounds.stop()
    silent = wait_for(sounds.getSound, lambda state: not state.playing)
    assert (silent.name, silent.count) == ("tone", begun.count)


def test_samples_come_whole_and_in_order_until_a_stop():
    """Its clock moves by hand: no load of the machine takes the time of a block from its server."""
    clock = RobotClock(0.0, 0.0, simulated=False, silence=math.inf)
    robot, sent = FakeRobot(clock), random.Random(1).randbytes(40_000)
    arrived: Queue[SoundSamples] = Queue()

    def go_on(seconds):
        clock.update(clock.now() + seconds, 0.0, simulated=False)
        client.assembly.on_wake()  # a thread that looked at the clock just before looks again

    def next_samples():
        while not (now := arrived.get(timeout=EVENT_LIMIT)).samples:
            pass
        return now

    with served_to_client(robot) as client:
        sounds = client.proxy(SoundsPrx, "Sounds")
        publisher = cast("Sounds", client.assembly.servants["Sounds"]).getSamplesPublisher
        assert not publisher.listening
        with sounds.getSamples.subscribe(lambda sample: arrived.put(sample.value), queue=10):
            until(lambda: go_on(0.02) or arrived.qsize())
            assert robot.loudspeaker is not None
            robot.loudspeaker.play_samples("song", sent)
            go_on(0.11)
            for block in range(4):
                go_on(0.25)
                now, part = next_samples(), sent[8000 * block :][:8000]
                assert (now.count, now.place, now.samples) == (1, 4000 * block, part)
                assert sounds.getSamples().samples == part
            sounds.stop()
            go_on(0.02)
            assert arrived.get(timeout=EVENT_LIMIT).samples == sounds.getSamples().samples == b""
        until(lambda: not publisher.listening)


@pytest.mark.parametrize(
    ("field", "play"),
    [
        ("name", lambda sounds: sounds.play("moo", 0.5)),
        ("loudness", lambda sounds: sounds.play("beep", 1.1)),
        ("loudness", lambda sounds: sounds.playTone(440.0, 1.0, -0.1)),
        ("loudness", lambda sounds: sounds.playTone(440.0, 1.0, math.nan)),
        ("frequency", lambda sounds: sounds.playTone(49.0, 1.0, 0.5)),
        ("frequency", lambda sounds: sounds.playTone(8001.0, 1.0, 0.5)),
        ("seconds", lambda sounds: sounds.playTone(440.0, 0.0, 0.5)),
        ("seconds", lambda sounds: sounds.playTone(440.0, 10.1, 0.5)),
    ],
)
def test_what_cannot_be_played_is_refused_by_name(sounds, field, play):
    before = sounds.getSound().count
    with pytest.raises(InvalidValueException) as refusal:
        play(sounds)
    assert refusal.value.field == field
    assert sounds.getSound().count == before
