"""Senses, cameras, lights and voice."""

import math
from contextlib import suppress
from dataclasses import astuple
from typing import cast

import numpy as np
import pytest

from naoserver.bodies.capabilities import Lights, Loudspeaker, Senses, Voice
from naoserver.conformance._robot import (
    BATTERY,
    CAMERA,
    INERTIAL_UNIT,
    LIGHTS,
    LOUDSPEAKER,
    PRESSURE,
    SONAR,
    STANDING,
    TOUCH,
    VOICE,
    RobotClient,
    needs,
)
from naoserver.errors import CommandRefused, HardwareFailure
from naoserver.protocol.expression import single_tone

GRAVITY = 9.81  # m/s2


@pytest.fixture
def senses(nao: RobotClient) -> Senses:
    """Its senses."""
    assert nao.robot.senses is not None, "its body has senses, and the robot has none"
    return nao.robot.senses


@needs(INERTIAL_UNIT)
def test_the_inertial_unit_feels_gravity_at_rest(rest: RobotClient, senses: Senses) -> None:
    """At rest the inertial unit feels 9.81 m/s2 upwards, where its roll and pitch say that up is."""

    def feels_gravity() -> bool:
        reading = senses.inertial()
        off = np.subtract(reading.acceleration, np.multiply(reading.up, GRAVITY))
        return bool(np.linalg.norm(off) < 1.5) and math.hypot(*reading.angular_velocity) < 0.1

    rest.until(feels_gravity, f"at rest it feels gravity: {senses.inertial()}")
    assert rest.robot.state().torso_tilt == pytest.approx(senses.inertial().tilt, abs=0.1)


@needs(PRESSURE, STANDING)
def test_the_soles_carry_the_weight(rest: RobotClient, senses: Senses) -> None:
    """The soles of a robot that stands carry its weight between them, in N."""
    weight = GRAVITY * rest.robot.body.mass

    def carry_it() -> bool:
        left, right = senses.read().left_foot.total, senses.read().right_foot.total
        return min(left, right) > 0.2 * weight and abs(left + right - weight) < 0.1 * weight

    rest.until(carry_it, f"each bears a part of {weight:.1f} N: {senses.read()}")
    reading = senses.read()
    assert min(*astuple(reading.left_foot), *astuple(reading.right_foot)) >= 0.0, "a sole pulls at the floor"


@needs(SONAR)
def test_the_sonar_measures_within_its_range_or_nothing(senses: Senses) -> None:
    """The sonar measures distances in m within its range, or infinity."""
    nearest, farthest = senses.sonar_range or (0.0, 0.0)
    reading = senses.read().sonar
    assert 0.0 < nearest < farthest < 10.0
    assert math.radians(20) < senses.sonar_cone < math.radians(90)
    assert all(each == math.inf or nearest <= each <= farthest for each in (reading.left, reading.right))


@needs(TOUCH)
def test_what_is_touched_has_a_name_of_the_body(nao: RobotClient, senses: Senses) -> None:
    """The touch sensors are those of the body."""
    assert senses.touch_names == nao.robot.body.touch_sensors
    assert senses.read().touched <= {*senses.touch_names}


@needs(BATTERY)
def test_the_battery_is_charged_from_0_to_1(senses: Senses) -> None:
    """The charge of the battery is from 0 to 1, or nan where the robot reports none."""
    battery = senses.read().battery
    assert math.isnan(battery.charge) or 0.0 <= battery.charge <= 1.0


@needs(CAMERA)
def test_a_camera_takes_images_of_each_size(nao: RobotClient) -> None:
    """An image has the size that was asked for and the time when it was taken, and is never changed again."""
    for facts in nao.robot.cameras:
        for width, height in facts.sizes[:2]:
            frame = nao.robot.capture(facts.name, width, height)
            was, pixels = frame.pixels.copy(), frame.pixels
            assert (frame.camera, frame.width, frame.height) == (facts.name, width, height)
            assert pixels.shape == (height, width, 3), "it is RGB, row 0 on top"
            assert (
                frame.time <= nao.robot.capture(facts.name, width, height).time <= nao.robot.clock.now() + 0.1
            )
            assert np.array_equal(pixels, was), "an image was changed after it was returned"
    with pytest.raises(HardwareFailure):
        nao.robot.capture("NoCamera", 320, 240)


@needs(LIGHTS)
def test_lights_fade_and_go_back(nao: RobotClient) -> None:
    """A light fades to a color within the given time, and goes back to the color after the start."""
    lights, body = cast("Lights", nao.robot.lights), nao.robot.body.lights
    name = lights.names[0]
    assert set(lights.names) == body.keys()
    lights.set(name, (0.0, 0.0, 0.0), 0.2)
    nao.until(lambda: max(lights.colors()[name]) < 0.01, f"{name} fades to black")
    lights.reset()
    nao.until(lambda: np.allclose(lights.colors()[name], body[name].start, atol=0.01), f"{name} goes back")


@needs(VOICE)
def test_a_text_is_begun_counted_and_ended(nao: RobotClient) -> None:
    """A text is said after the earlier ones; the voice falls silent when it is stopped."""
    voice = cast("Voice", nao.robot.voice)
    count = voice.utterance().count
    voice.say("Hello.")
    nao.until(lambda: voice.utterance().count == count + 1, "a text is begun and counted")
    assert voice.utterance().text == "Hello."
    nao.until(lambda: not voice.utterance().speaking, "a text ends")
    voice.say("This takes long to be said. " * 40)
    nao.until(lambda: voice.utterance().speaking, "it says so while it speaks")
    voice.stop()
    nao.until(lambda: not voice.utterance().speaking, "it falls silent when it is stopped")


@needs(LOUDSPEAKER)
def test_a_sound_is_begun_counted_and_replaced(nao: RobotClient) -> None:
    """A sound is played at its loudness; the sound before ends."""
    speaker = cast("Loudspeaker", nao.robot.loudspeaker)
    count = speaker.playback().count
    speaker.play(single_tone(440.0, 10.0), 0.1)
    nao.until(lambda: speaker.playback().playing, "a sound is begun")
    speaker.play(single_tone(880.0, 0.1), 0.2)
    now = speaker.playback()
    assert (now.tones[0].frequency, now.loudness, now.count) == (880.0, 0.2, count + 2)
    nao.until(lambda: not speaker.playback().playing, "a sound ends")


@needs(LOUDSPEAKER)
def test_samples_are_due_until_a_stop_or_refused(nao: RobotClient) -> None:
    """Samples are due one after the other, until a stop; a robot that plays tones alone refuses them."""
    speaker, sent = cast("Loudspeaker", nao.robot.loudspeaker), bytes(range(250)) * 320
    with suppress(CommandRefused):
        speaker.play_samples("samples", sent)
        nao.until(lambda: speaker.playback().samples, "samples are due")
        now = speaker.playback()
        assert now.samples == sent[2 * now.place :][: len(now.samples)]
    speaker.stop()
    nao.until(lambda: not speaker.playback().playing, "it falls silent when it is stopped")
    assert speaker.playback().samples == b""
