"""The scripts of examples/, run against a served robot."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from naoserver.fake import FakeRobot
from tests.support.limits import END_LIMIT, RUN_LIMIT
from tests.support.processes import REPOSITORY, ComponentProcess, free_endpoint
from tests.support.robot_server import served


@pytest.fixture(scope="module")
def environment() -> Iterator[dict[str, str]]:
    """What leads a script to a robot without physics."""
    endpoint = free_endpoint()
    with served(FakeRobot(), realm="nao", endpoint=endpoint):
        yield {"VISUALHFSM_CONNECT": endpoint, "PYTHONPATH": str(REPOSITORY)}


def command(name: str, *arguments: str) -> list[str]:
    return [sys.executable, str(REPOSITORY / "examples" / f"{name}.py"), *arguments]


def run(environment: dict[str, str], directory: Path, *arguments: str) -> str:
    result = subprocess.run(
        command(*arguments),
        env={**os.environ, **environment},
        cwd=directory,
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_save_image(environment: dict[str, str], tmp_path: Path) -> None:
    assert run(environment, tmp_path, "save_image", "Camera", "out.ppm").startswith(
        "out.ppm: 320x240, taken at"
    )
    header, pixels = (tmp_path / "out.ppm").read_bytes().split(b"\n", 1)
    assert header == b"P6 320 240 255"
    assert len(pixels) == 320 * 240 * 3
    assert len(set(pixels)) > 1


def test_watch_joints(environment: dict[str, str]) -> None:
    with ComponentProcess(command("watch_joints", "LKneePitch", "HeadYaw"), environment) as watching:
        watching.wait_for(r"\d+\.\d\d s  LKneePitch \+0\.7\d\d rad  HeadYaw")
        watching.wait_for("HeadYaw")
        watching.process.send_signal(2)
        assert watching.wait(END_LIMIT) == 130
        assert "Traceback" not in watching.output


@pytest.mark.parametrize("name", ["turn_head", "save_image", "watch_joints"])
def test_without_a_robot_an_example_says_how_to_start_one(name: str) -> None:
    nowhere = {
        "VISUALHFSM_CONNECT": free_endpoint(), "VISUALHFSM_TIMEOUT": "0.2", "PYTHONPATH": str(REPOSITORY)
    }  # fmt: skip
    with ComponentProcess(command(name), nowhere) as example:
        assert example.wait() == 1
        assert "naoserver-sim" in example.output
        assert example.output.count("\n") == 1


def test_a_joint_that_does_not_exist_is_named(environment: dict[str, str]) -> None:
    with ComponentProcess(command("watch_joints", "LeftKnee"), environment) as watching:
        assert watching.wait() == 1
        assert watching.output.startswith("there is no joint LeftKnee; there are HeadYaw")
