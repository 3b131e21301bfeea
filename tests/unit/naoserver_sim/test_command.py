import math

import pytest
import typer

from naoserver.bodies.nao import H25
from naoserver.errors import RobotError
from naoserver_sim._command import app, check_cameras, parse_arguments, parse_cameras, parse_speed
from naoserver_sim.model import simulated_cameras
from tests.support.commands import run_here
from tests.support.models import MODELS
from tests.support.plugins import OWN_ROBOTS


@pytest.mark.parametrize(("text", "factor"), [("1", 1.0), ("0.5", 0.5), ("20", 20.0), ("max", math.inf)])
def test_speed(text, factor):
    assert parse_speed(text) == factor


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "fast", ""])
def test_speed_that_is_none(text):
    with pytest.raises(typer.BadParameter, match="not a speed"):
        parse_speed(text)


def test_arguments_of_a_xacro():
    assert parse_arguments(["dof:=7", "at:=a:=b", "empty:="]) == {"dof": "7", "at": "a:=b", "empty": ""}


@pytest.mark.parametrize("text", ["dof", "dof=7", ":=7", "7:=dof", "a b:=1", ""])
def test_an_argument_that_is_none(text):
    with pytest.raises(typer.BadParameter, match="write NAME:=VALUE, such as dof:=7"):
        parse_arguments([text])


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


@OWN_ROBOTS
@pytest.mark.sim
def test_a_body_is_written_instead_of_served(tmp_path):
    (tmp_path / "robot.urdf").write_text(MODELS["head"])
    words = ("--body", "robot.urdf", "--write-body", "my_robot.toml")
    done = run_here(app, "naoserver-sim", *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "robot.urdf: groups.head: pan_joint tilt_joint (pan, tilt in its names)\n" in done.stdout
    assert 'model = "robot.urdf"' in (tmp_path / "my_robot.toml").read_text()
    again = run_here(app, "naoserver-sim", *words, cwd=tmp_path, expected=(RobotError,))
    assert "my_robot.toml exists: --force overwrites it" in again.stderr
    assert run_here(app, "naoserver-sim", *words, "--force", cwd=tmp_path).returncode == 0


def test_a_body_of_ours_is_not_written(tmp_path):
    done = run_here(
        app, "naoserver-sim", "--body", "H25", "--write-body", "h25.toml", cwd=tmp_path, columns=200
    )
    assert "H25 is no file: this writes a robot of your own" in done.stderr
    assert not (tmp_path / "h25.toml").exists()
