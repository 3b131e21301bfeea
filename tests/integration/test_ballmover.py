"""The command ballmover against a served robot, in a separate process where it ends at a signal."""

from __future__ import annotations

import math
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from ballmover._cli import app
from ballmover._waypoints import Color, built_in_waypoints
from interfaces.jderobot import Pose3DEncodersData, Pose3DEncodersPrx, Pose3DMotorsData, Pose3DMotorsPrx
from naoserver.fake import FakeRobot
from tests.support.commands import run_here
from tests.support.limits import CALL_LIMIT, END_LIMIT, EVENT_LIMIT
from tests.support.processes import STEADY, ComponentProcess, free_endpoint, module
from tests.support.robot_server import served
from zenoh_ice import initialize

DEBUG = ("--log-level", "debug")


@pytest.fixture(scope="module")
def robot() -> Iterator[str]:
    """Where a robot without physics is served."""
    endpoint = free_endpoint()
    with served(FakeRobot(), realm="nao", endpoint=endpoint):
        yield endpoint


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command, without what the robot logs in the meantime: it is served by this process, too."""
    result = run_here(app, "ballmover", *arguments)
    lines = result.stderr.splitlines(keepends=True)
    result.stderr = "".join(line for line in lines if " naoserver." not in line)
    return result


def write(path: Path, *lines: str) -> str:
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def place(data: Pose3DEncodersData) -> tuple[float, float, float]:
    return data.x * math.cos(data.pan), data.x * math.sin(data.pan), data.z


def ball_place(robot: str, identity: str) -> tuple[float, float, float]:
    with initialize(connect=[robot], lease=CALL_LIMIT) as communicator:
        encoders = Pose3DEncodersPrx.checkedCast(communicator.stringToProxy(identity))
        return place(encoders.getPose3DEncodersData())


def test_once_carries_the_ball_to_the_last_waypoint_and_ends(robot: str, tmp_path: Path) -> None:
    file = write(
        tmp_path / "path.csv", "x,y,z,speed,dwell", "0.9,0.1,0.5", "0.9,-0.1,0.6,1,0.1", "1,-0.1,0.6"
    )
    result = run("red", file, "--once", "--speed", "0.8", "--connect", robot, *DEBUG)
    assert result.returncode == 0
    assert result.stdout == "red: 3 waypoints\n"
    assert "WARNING" not in result.stderr
    log = [line.partition("ballmover._mover: ")[2] for line in result.stderr.splitlines()]
    assert [line for line in log if "waypoint" in line] == [
        "red: waypoint 1 of 3 (0.9, 0.1, 0.5) at 0.8 m/s",
        "red: waypoint 2 of 3 (0.9, -0.1, 0.6) at 1 m/s",
        "red: waypoint 3 of 3 (1, -0.1, 0.6) at 0.8 m/s",
    ]
    assert ball_place(robot, "BallRedEncoders") == pytest.approx((1.0, -0.1, 0.6), abs=0.02)


def test_a_robot_without_balls_says_who_has_some(monkeypatch: pytest.MonkeyPatch) -> None:
    endpoint, real = free_endpoint(), FakeRobot()
    monkeypatch.setattr(real, "mechanisms", ())
    with served(real, realm="nao", endpoint=endpoint):
        result = run("red", "--connect", endpoint)
    assert result.returncode == 1
    assert result.stderr.endswith(
        "ballmover: error: the robot of realm 'nao' has no red ball: only a simulation has balls, such as "
        "naoserver-sim --world balls\n"
    )


def test_a_signal_ends_it_cleanly_and_stops_the_ball(robot: str, tmp_path: Path) -> None:
    # There at once, then so slowly that it is still on its way whenever the signal comes.
    file = write(tmp_path / "path.csv", "x,y,z,speed", "0.8,0.4,0.5,1", "0.8,-0.4,0.5,0.02")
    with initialize(connect=[robot], lease=CALL_LIMIT) as communicator:
        encoders = Pose3DEncodersPrx.checkedCast(communicator.stringToProxy("BallGreenEncoders"))
        command = module("ballmover", "green", file, "--connect", robot, *DEBUG)
        with ComponentProcess(command, STEADY) as mover:
            mover.wait_for("waypoint 2 of 2")
            moving = next(s for s in encoders.getPose3DEncodersData.samples() if place(s.value)[1] < 0.39)
            mover.process.send_signal(signal.SIGINT)
            assert mover.wait(END_LIMIT) == 130
            assert "Traceback" not in mover.output
            stopped = encoders.getPose3DEncodersData()
            # It was stopped where it was, not just left on its way to the last setpoint.
            assert -0.35 < place(stopped)[1] <= place(moving.value)[1]
            later = encoders.getPose3DEncodersData.wait(timeout=EVENT_LIMIT)
            assert place(later.value) == pytest.approx(place(stopped), abs=0.01)


def test_built_in_waypoints_are_within_reach_of_the_served_balls(robot: str) -> None:
    with initialize(connect=[robot], lease=CALL_LIMIT) as communicator:
        for color in Color:
            proxy = communicator.stringToProxy(f"Ball{color.capitalize()}Motors")
            motors = Pose3DMotorsPrx.checkedCast(proxy)
            for x, y, z in (waypoint.point for waypoint in built_in_waypoints(color)):
                place = {"x": math.hypot(x, y), "y": 0.0, "z": z, "pan": math.atan2(y, x)}
                data = Pose3DMotorsData(**place, tilt=0.0, roll=0.0, panSpeed=0.0, tiltSpeed=0.0)
                assert motors.setPose3DMotorsData(data) == 0, f"{color}: {x}, {y}, {z} is limited"


@pytest.mark.parametrize(
    ("last", "said"),
    [
        ("0.9,nil,0.5", "path.csv:3: y = 'nil'"),
        ("0.9,0,50,1000", "waypoint 2 of 2 (0.9, 0, 50): after 5 s the ball is still"),
    ],
    ids=["a file with an error", "out of reach"],
)
def test_what_cannot_be_done_is_said_in_one_line(robot: str, tmp_path: Path, last: str, said: str) -> None:
    file = write(tmp_path / "path.csv", "x,y,z,speed", "0.9,0,0.5,1", last)
    result = run("green", file, "--connect", robot)
    assert result.returncode == 1
    assert result.stderr.startswith("ballmover: error: ")
    assert said in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_ball_of_another_color_is_wrong_usage() -> None:
    result = run("blue")
    assert (result.returncode, result.stdout) == (2, "")
    assert "'green', 'red'" in result.stderr
