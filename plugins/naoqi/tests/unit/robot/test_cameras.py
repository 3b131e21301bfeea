"""Pictures of ALVideoDevice: subscribed once, released, and checked before they are used."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.errors import HardwareFailure
from naoserver.hardware.connection import CallFailed
from plugins.naoqi.tests.support.scripted import HASTY, ScriptedNaoqi
from visualhfsm_naoqi.robot._cameras import Stamps, frame_of
from visualhfsm_naoqi.robot._link import NAME

SIZE = (320, 240)
GET, SUBSCRIBE, RELEASE = (
    f"ALVideoDevice.{method}" for method in ("getImageRemote", "subscribeCamera", "unsubscribe")
)


def picture(stamp=1.0, size=SIZE, layers=3, brightness=7):
    pixels = bytearray([brightness]) * (size[0] * size[1] * layers)
    seconds = int(stamp)
    return (*size, layers, 11, seconds, round((stamp - seconds) * 1e6), pixels, 0, 0.5, 0.4, -0.5, -0.4)


@pytest.fixture
def naoqi():
    naoqi = ScriptedNaoqi()
    stamps = iter(range(1, 100_000))
    naoqi.answers[GET] = lambda _handle: picture(next(stamps) / 30)
    return naoqi


def test_a_camera_is_subscribed_once_and_released_at_the_end(naoqi):
    with naoqi.robot() as robot:
        frames = [robot.capture("Camera", *SIZE) for _ in range(3)]
        assert naoqi.called(SUBSCRIBE) == [(NAME, 0, 1, 11, 30)]
        assert naoqi.called(RELEASE) == []
    assert naoqi.called(RELEASE) == [("handle",)]
    assert [(frame.width, frame.height) for frame in frames] == [SIZE] * 3
    assert np.all(frames[0].pixels == 7)


def test_another_size_releases_the_one_before(naoqi):
    with naoqi.robot() as robot:
        robot.capture("Camera", *SIZE)
        naoqi.answers[GET] = lambda _handle: picture(9.0, (640, 480))
        robot.capture("Camera", 640, 480)
        assert [call[2] for call in naoqi.called(SUBSCRIBE)] == [1, 2]
        assert len(naoqi.called(RELEASE)) == 1


def test_both_cameras_have_their_own(naoqi):
    with naoqi.robot() as robot:
        robot.capture("Camera", *SIZE)
        robot.capture("CameraBottom", *SIZE)
        assert [call[1] for call in naoqi.called(SUBSCRIBE)] == [0, 1]
    assert len(naoqi.called(RELEASE)) == 2


def test_what_an_earlier_server_left_is_released_first(naoqi):
    with naoqi.robot():
        assert naoqi.called("ALVideoDevice.unsubscribeAllInstances") == [(NAME,)]


def test_it_waits_for_a_picture_that_is_newer_than_the_last(naoqi):
    stamps = iter([1.0, 1.0, 1.0, 1.033])
    naoqi.answers[GET] = lambda _handle: picture(next(stamps))
    with naoqi.robot() as robot:
        first, second = (robot.capture("Camera", *SIZE) for _ in range(2))
    assert second.time > first.time


def test_a_camera_that_is_slow_gives_the_same_picture_again(naoqi):
    naoqi.answers[GET] = lambda _handle: picture(1.0)
    with naoqi.robot() as robot:
        assert robot.capture("Camera", *SIZE).time == robot.capture("Camera", *SIZE).time


@pytest.mark.slow
def test_no_picture_is_a_failure_that_names_the_camera(naoqi):
    naoqi.answers[GET] = None
    naoqi.limits = replace(HASTY, picture=0.1)
    with naoqi.robot() as robot, pytest.raises(HardwareFailure, match="CameraBottom returned no image"):
        robot.capture("CameraBottom", *SIZE)


def test_no_subscription_is_a_failure_that_says_what_may_be_the_reason(naoqi):
    naoqi.answers[SUBSCRIBE] = ""
    with naoqi.robot() as robot, pytest.raises(HardwareFailure, match="other programs may hold too many"):
        robot.capture("Camera", *SIZE)


def test_a_subscription_that_somebody_ended_is_made_again(naoqi):
    good = naoqi.answers[GET]

    def ended(_handle):
        raise CallFailed("there is no subscription")

    with naoqi.robot() as robot:
        robot.capture("Camera", *SIZE)
        naoqi.answers[GET] = ended
        with pytest.raises(HardwareFailure, match="no subscription"):
            robot.capture("Camera", *SIZE)
        naoqi.answers[GET] = good
        robot.capture("Camera", *SIZE)
        assert len(naoqi.called(SUBSCRIBE)) == 2


def test_an_older_head_has_smaller_pictures_and_its_own_field_of_view(naoqi):
    naoqi.memory["RobotConfig/Head/BaseVersion"] = "V5.0"
    naoqi.answers["ALVideoDevice.getHorizontalFOV"] = 1.06
    with naoqi.robot() as robot:
        camera = robot.cameras[0]
    assert max(camera.sizes) == (1280, 960)
    assert camera.horizontal_fov == 1.06


def test_a_closed_robot_takes_no_picture(naoqi):
    with naoqi.robot() as robot:
        pass
    with pytest.raises(HardwareFailure, match="closed"):
        robot.capture("Camera", *SIZE)


@pytest.mark.parametrize(
    "image",
    [
        picture(size=(160, 120)),
        picture(layers=1),
        picture()[:5],
        (*picture()[:6], "text", *picture()[7:]),
        (*picture()[:6], None, *picture()[7:]),
        "b'...'",
    ],
)
def test_what_is_no_picture_of_the_size_is_refused(image):
    with pytest.raises(HardwareFailure, match="Camera"):
        frame_of(image, "Camera", SIZE)


@given(st.lists(st.tuples(st.floats(0.03, 0.05), st.floats(0.0, 0.5)), min_size=1, max_size=50))
def test_pictures_are_never_reported_younger_than_they_are(periods):
    """The clocks differ by 1000 s; each picture arrives after another delay."""
    stamps, taken = Stamps(), 0.0
    fastest = min(delay for _, delay in periods)
    for period, delay in periods:
        taken += period
        steady = stamps.steady(taken, taken + 1000.0 + delay)
        assert taken + 1000.0 + fastest - 1e-9 <= steady <= taken + 1000.0 + delay + 1e-9
