"""Programs of pages run beside the robot that their fence names, and print what stands below them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from typing import Final

import pytest

from naoserver.bodies import find_body
from naoserver.fake import FakeRobot
from naoserver.robot import Robot
from naoserver_sim.robot import SimulatedRobot
from tests.support.pages import DOCS, Block, blocks_of, pages
from tests.support.reader import matches
from tests.support.robot_server import served

ROBOTS: Final[dict[str, Callable[[], Robot]]] = {
    "fake": FakeRobot,
    "simulated": lambda: SimulatedRobot(skin=False, speed=5.0),
    "T1": lambda: SimulatedRobot(skin=False, body=find_body("T1")),
}
"""Robots by what stands in the fence of a program: `python robot=fake`, or `robot=none`."""
BETWEEN: Final = {"how-to/walk.md": (0.3, 1.5)}
"""Pages that show a figure of one run, and between which it is in others."""
ELSEWHERE: Final = {"../plugins/learning/docs/learning.md", "how-to/plain-python.md"}
"""Pages that have tests by themselves."""

Program = tuple[str, Block, Block]
"""A page, a program and its output."""


def programs() -> Iterator[Program]:
    """Yield the programs of all pages below which their output stands."""
    for page in pages("."):
        for program, output in pairwise(blocks_of((DOCS / page).read_text("utf-8"))):
            if (program.language, output.language, program.name) == ("python", "text", None):
                yield page, program, output


def robot_of(program: Program) -> str:
    """Return what the fence of a program names."""
    found = re.search(r"robot=(\w+)", program[1].info)
    return found[1] if found else ""


@pytest.mark.parametrize(
    "shown",
    [
        pytest.param(each, id=each[0], marks=[pytest.mark.sim] * (robot_of(each) not in {"none", "fake"}))
        for each in programs()
        if robot_of(each)
    ],
)
def test_a_program_prints_what_the_page_says(
    shown: Program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page, program, output = shown
    monkeypatch.chdir(tmp_path)
    with ExitStack() as stack:
        if (robot := robot_of(shown)) != "none":
            server = stack.enter_context(served(ROBOTS[robot]()))
            monkeypatch.setenv("VISUALHFSM_REALM", server.realm)
            monkeypatch.setenv("VISUALHFSM_CONNECT", server.endpoint)
        exec(compile(program.text, page, "exec"), {"__name__": "__main__"})
    printed, expected = capsys.readouterr().out, output.text
    if page in BETWEEN:
        least, most = BETWEEN[page]
        (figure,) = re.findall(r"\d+\.\d+", printed)
        assert least < float(figure) < most
        printed, expected = (re.sub(r"\d+\.\d+", "N", text) for text in (printed, expected))
    assert matches(expected, printed), printed


def test_each_program_says_beside_which_robot_it_runs() -> None:
    assert {each[0] for each in programs() if not robot_of(each)} <= ELSEWHERE
