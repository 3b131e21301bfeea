import math

import pytest
import typer

from naoserver.bodies.nao import H25
from naoserver_sim._command import check_cameras, parse_cameras, parse_speed
from naoserver_sim.model import simulated_cameras


@pytest.mark.parametrize(("text", "factor"), [("1", 1.0), ("0.5", 0.5), ("20", 20.0), ("max", math.inf)])
def test_speed(text, factor):
    assert parse_speed(text) == factor


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "fast", ""])
def test_speed_that_is_none(text):
    with pytest.raises(typer.BadParameter, match="not a speed"):
        parse_speed(text)


def test_camera_setting():
    options = parse_cameras(["Camera=640x480@15", "CameraBottom=320x240"])
    assert (options["Camera"].width, options["Camera"].height, options["Camera"].rate) == (640, 480, 15.0)
    assert options["CameraBottom"].rate == 10.0


@pytest.mark.parametrize("text", ["Camera", "Camera=640", "Camera=640x480@", "=640x480", "Camera=-1x2"])
def test_camera_setting_that_is_none(text):
    with pytest.raises(typer.BadParameter, match="WIDTHxHEIGHT"):
        parse_cameras([text])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Left=320x240", "there is no camera 'Left'; there are Camera, CameraBottom, CameraOutside"),
        ("Camera=321x240", "320x240 up to 30/s"),
        ("Camera=320x240@31", "320x240 up to 30/s"),
        ("Camera=320x240@0", "320x240 up to 30/s"),
    ],
)
def test_camera_setting_that_no_camera_has(text, message):
    with pytest.raises(typer.BadParameter, match=message):
        check_cameras(parse_cameras([text]), simulated_cameras(H25))
