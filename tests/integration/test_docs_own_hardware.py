"""docs/how-to/own-hardware.md: what it makes follows a ball, and what it says of faults is so."""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path
from typing import Final

import pytest

from interfaces.nao import PoseHeadPrx
from naoserver.hardware.servos import ServoBus
from naoserver.hardware.sim_bus import SimBus
from tests.support.limits import MOVE_LIMIT
from tests.support.pages import DOCS, blocks_of, sections_of
from tests.support.places import ROOT
from tests.support.processes import STEADY, ComponentProcess, free_endpoint, module
from tests.support.reader import commands_of
from tests.support.waiting import until
from visualhfsm._commands.new import new
from zenoh_ice import initialize

PAGE: Final = "how-to/own-hardware.md"
NEAR: Final = 0.15
"""How far the head is from the ball that it follows, at most, in rad."""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """What the command of the page makes."""
    folder = tmp_path / "my-bust"
    new(folder, hardware=True)
    return folder


def test_the_behavior_of_the_paper_follows_the_ball_unchanged(project: Path) -> None:
    pytest.importorskip("cv2", reason="nao eyes sees with OpenCV")
    endpoint = free_endpoint()
    environment = {**STEADY, "PYTHONPATH": str(ROOT), "VISUALHFSM_REALM": "bust"}
    serve = [sys.executable, "server.py", "--start", "stiffen", "--listen", endpoint]
    see = module("nao_tools", "eyes", "--connect", endpoint)
    follow = [sys.executable, "-P", str(ROOT / "behaviors/follow_ball.py"), "--connect", endpoint]
    with ComponentProcess(serve, environment, project) as server:
        server.wait_for("^ready: realm bust, .*, bus simulated")
        with (
            ComponentProcess(see, environment, project) as eyes,
            ComponentProcess(follow, environment, project),
            initialize(realm="bust", connect=[endpoint]) as communicator,
        ):
            eyes.wait_for("^ready: Sight in realm bust, of Camera")
            head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
            distances = []

            def follows() -> bool:
                pose = head.getPose()
                ball = 0.5 * math.sin(0.5 * pose.time)
                distances.append(abs(pose.pan - ball))
                return len(distances) > 50 and max(distances[-50:]) < NEAR

            until(follows, MOVE_LIMIT)


def test_every_excerpt_is_of_the_files_that_are_made(project: Path) -> None:
    made = "\n".join(
        path.read_text("utf-8") for path in project.glob("*.*") if path.suffix in (".py", ".toml")
    )
    excerpts = [
        block for block in blocks_of((DOCS / PAGE).read_text("utf-8")) if block.language in ("python", "toml")
    ]
    assert len(excerpts) >= 3
    assert [block.text for block in excerpts if block.text not in made] == []


def test_the_files_are_those_that_the_page_shows(project: Path) -> None:
    (tree,) = (
        block.text for block in blocks_of((DOCS / PAGE).read_text("utf-8")) if "my-bust/\n" in block.text
    )
    shown = {line.split()[0] for line in tree.splitlines()[1:]}
    files = {path.relative_to(project).as_posix() for path in project.rglob("*") if path.is_file()}
    assert shown == {name for name in files if not name.startswith(".")}


def test_the_methods_and_the_faults_of_the_page_are_those_of_the_bus(tmp_path: Path) -> None:
    tables = {section.title: section.text for section in sections_of(PAGE)}
    methods = set(re.findall(r"^\| `(\w+)` \|", tables["Write in your servos"], re.M))
    assert methods == {name for name in vars(ServoBus) if not name.startswith("_")} | {"close"}
    bus = SimBus(4, tmp_path / "tty")
    typed = re.findall(r"^\| `([\w ]+)` \|", tables["Let something fail"], re.M)
    assert len(typed) == 5
    assert [bus.command(line) for line in typed] == ["done"] * 5
    bus.close()


def test_the_readme_that_is_made_shows_commands_of_the_page_and_of_every_robot(project: Path) -> None:
    def typed(text: str) -> set[str]:
        return {
            command.text for block in blocks_of(text) for command in commands_of(block.text, block.language)
        }

    page = typed((DOCS / PAGE).read_text("utf-8"))
    others = typed((project / "README.md").read_text("utf-8")) - page
    assert others == {
        "nao stack ./stack.toml",
        "nao stack ./stack.toml --set bus=/dev/ttyUSB0",
        "nao stop",
        "visualhfsm edit",
    }
