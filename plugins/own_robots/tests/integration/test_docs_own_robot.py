"""plugins/own_robots/docs/own-robot.md: its robots are served by a process as it says, and its programs print what it says."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest
from msgspec import Struct
from msgspec.structs import fields

from interfaces.nao import DescriptionPrx, GroundTruthPrx, PoseHeadPrx
from naoserver.bodies import parts
from naoserver.bodies.parts import Hinge, Inertia, Joint, JointFacts, Link, Motor, Shape
from naoserver.body import Body, write_body
from naoserver.errors import RobotError
from naoserver_sim.named_body import named_body
from tests.support.limits import MOVE_LIMIT, RUN_LIMIT
from tests.support.pages import blocks_of, sections_of
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.reader import commands_of
from tests.support.robot_server import HASTE
from tests.support.waiting import until
from visualhfsm_own_robots import read_own_body, write_own_body
from zenoh_ice import initialize

pytestmark = [pytest.mark.sim, pytest.mark.gl]

PAGE: Final = (ROOT / "plugins/own_robots/docs/own-robot.md").read_text("utf-8")
BLOCKS: Final = blocks_of(PAGE)
NOT_IN_FILES: Final = (Hinge, Inertia, Joint, JointFacts, Link, Motor, Shape)
"""Parts that come from the model, or are made of others."""
TABLES: Final = [
    part
    for part in vars(parts).values()
    if isinstance(part, type) and issubclass(part, Struct) and part not in NOT_IN_FILES
]
OUTPUTS: Final = {
    command.text.split()[-1]: command.output
    for block in BLOCKS
    for command in commands_of(block.text, block.language)
    if command.text.startswith("python ") and command.output
}
"""What the page says that each program prints."""
FOLLOWS: Final = math.radians(6)
"""How far the middle of the picture is from a ball that the head follows, at most: the ball stands still."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the page shows."""
    made = tmp_path_factory.mktemp("own")
    for block in BLOCKS:
        if block.name is not None:
            (made / block.name).write_text(block.text, "utf-8")
    return made


@contextmanager
def server(folder: Path, body: str, said: Sequence[str] = ("^ready",)) -> Iterator[dict[str, str]]:
    """Serve a body of the page, which says some lines; yield the environment of its clients."""
    endpoint = free_endpoint()
    command = module("naoserver_sim", "--body", body, "--realm", "own", "--listen", endpoint)
    with ComponentProcess(command, {"PYTHONPATH": str(ROOT)}, folder) as process:
        for line in said:
            process.wait_for(line)
        yield {
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "VISUALHFSM_REALM": "own",
            "VISUALHFSM_CONNECT": endpoint,
        }


@pytest.fixture(scope="module")
def cart(folder: Path) -> Iterator[dict[str, str]]:
    """The cart of the page, which several tests use; the environment of its clients."""
    with server(folder, "my_robot.toml") as environment:
        yield environment


def printed(folder: Path, program: str, environment: dict[str, str]) -> str:
    """Return what a program of the page prints."""
    done = subprocess.run(
        [sys.executable, program],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.rstrip()


def test_the_papers_behavior_follows_the_ball_with_its_head(folder: Path, cart: dict[str, str]) -> None:
    with (
        ComponentProcess([sys.executable, str(ROOT / "behaviors/follow_ball.py")], cart, folder),
        initialize(realm="own", connect=[cart["VISUALHFSM_CONNECT"]]) as communicator,
    ):
        head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
        truth = GroundTruthPrx.checkedCast(communicator.stringToProxy("GroundTruth"))
        ball = truth.getGroundTruth().objects["BallGreen"].position
        place = truth.getGroundTruth().torso.position
        bearing = math.atan2(ball.y - place.y, ball.x - place.x)
        until(lambda: abs(head.getPose().pan - bearing) < FOLLOWS, MOVE_LIMIT)


def test_a_behavior_says_before_it_starts_what_the_cart_lacks(cart: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "behaviors/dance.py")],
        env={**cart, "VISUALHFSM_TIMEOUT": str(HASTE)},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode != 0
    assert "cannot start" in done.stderr
    assert {"RightShoulderMotors", "LeftElbowMotors"} <= set(re.findall(r"\w+", done.stderr))


def test_the_cart_does_what_the_page_says(folder: Path, cart: dict[str, str]) -> None:
    assert printed(folder, "drive.py", cart) == OUTPUTS["drive.py"]


def test_the_lamp_of_a_urdf_does_what_the_page_says(folder: Path) -> None:
    with server(folder, "lamp.toml") as environment:
        assert printed(folder, "look.py", environment) == OUTPUTS["look.py"]
        with initialize(realm="own", connect=[environment["VISUALHFSM_CONNECT"]]) as communicator:
            description = DescriptionPrx.checkedCast(communicator.stringToProxy("Description"))
            looks = json.loads(description.getLooks())
    assert {(shape["link"], shape["kind"]) for shape in looks["shapes"]} == {
        ("foot", "cylinder"),
        ("pole", "box"),
        ("shade", "mesh"),
    }
    assert {tuple(shape["color"]) for shape in looks["shapes"] if shape["link"] == "shade"} == {
        (0.95, 0.8, 0.3)
    }


def test_what_is_guessed_is_written_with_its_reasons(folder: Path) -> None:
    command = module("naoserver_sim", "--body", "rover.xml", "--write-body", "guessed.toml")
    subprocess.run(
        command, cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)}, timeout=RUN_LIMIT, check=True
    )
    text = (folder / "guessed.toml").read_text("utf-8")
    (shown,) = [block.text for block in BLOCKS if block.language == "toml" and "speed for" in block.text]
    assert shown in text
    guessed, corrected = (read_own_body(folder / name) for name in ("guessed.toml", "my_robot.toml"))
    assert (guessed.groups, guessed.hinges) == (corrected.groups, corrected.hinges)
    assert write_body(guessed) == write_body(read_own_body(folder / "rover.xml"))


def test_the_facts_of_a_body_are_written_and_read_without_its_model(folder: Path, tmp_path: Path) -> None:
    write_own_body(folder / "my_robot.toml", tmp_path / "rover.json")
    assert named_body(tmp_path / "rover.json").name == "Rover"


def test_a_model_without_a_torque_is_refused_as_the_page_says(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (said,) = re.findall(r"naoserver-sim: error: (.*?)\n```", PAGE, re.DOTALL)
    model = (folder / "rover.xml").read_text("utf-8")
    (tmp_path / "rover.xml").write_text(
        re.sub(r'(<position joint="pan".*) forcerange="[^"]*"', r"\1", model), "utf-8"
    )
    (tmp_path / "my_robot.toml").write_text((folder / "my_robot.toml").read_text("utf-8"), "utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RobotError) as refused:
        read_own_body(Path("my_robot.toml"))
    assert str(refused.value) == said


@pytest.mark.parametrize("part", [Body, *TABLES], ids=lambda part: part.__name__)
def test_the_reference_has_every_key(part: type[Struct]) -> None:
    (section,) = [each for each in sections_of("reference/bodies.md") if each.title.startswith("Keys of")]
    keys = set(re.findall(r"[`[.](\w+)", section.text))
    names = {field.encode_name for field in fields(part)}
    assert sorted(names - keys) == []
