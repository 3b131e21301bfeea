"""`visualhfsm sweep`, as a user calls it: each failure of the robot, and what becomes of the behavior."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.commands import run_here
from tests.support.documents import document, state, sub, transition
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app
from visualhfsm_trials._record import read_outcomes

pytestmark = pytest.mark.slow

CONFIG = (
    "<iceinterface><nameinterface>Battery</nameinterface><nameproxy>Battery</nameproxy><ip>localhost</ip>"
    "<port>7447</port><interface>Battery</interface></iceinterface>"
)
RESTS = document(
    sub(
        1,
        0,
        state(1, "awake", initial=True),
        state(2, "tired", "raise RuntimeError('no power')"),
        transition(1, 1, 2, "self.Battery.getBatteryReading().charge < 0.1"),
    ),
    config=CONFIG,
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "rests.xml").write_text(RESTS, "utf-8")
    (tmp_path / "rests.trials.toml").write_text('robot = "fake"\nlimit = 8\n', "utf-8")
    return tmp_path


def sweep(folder: Path, *arguments: str, code: int = 0) -> str:
    done = run_here(
        app, "visualhfsm", "sweep", *arguments, cwd=folder, expected=(VisualHfsmError,), columns=100
    )
    assert done.returncode == code, done.stderr
    return done.stdout if code == 0 else done.stderr


def test_each_failure_of_some_parts_is_tried_and_shown_in_a_matrix(folder: Path) -> None:
    shown = sweep(folder, "rests.xml", "--part", "Battery", "--part", "Camera", "--moments", "2")
    lines = [line.split() for line in shown.splitlines()]
    assert ["black", "frozen", "blurred", "late", "halved", "low"] in lines
    assert ["Camera", *["ss"] * 5] in lines  # it never moves
    assert ["Battery", "ss"] in lines
    assert "s stopped: 12" in shown
    outcomes = {outcome.number: outcome for outcome in read_outcomes(folder / "rests.sweep.outcomes.jsonl")}
    assert [outcomes[number].values["failure"] for number in (1, 6, 7)] == [
        "Camera black",
        "Battery low",
        "Camera black",
    ]
    assert "no power" in outcomes[6].reason
    assert not outcomes[1].reason


def test_without_parts_one_side_of_the_body_fails(folder: Path) -> None:
    sweep(folder, "rests.xml", "--limit", "1")
    failures = [
        str(outcome.values["failure"]) for outcome in read_outcomes(folder / "rests.sweep.outcomes.jsonl")
    ]
    parts = {failure.rpartition(" ")[0] for failure in failures}
    assert {"LKneePitch", "HeadYaw", "Camera", "ChestButton", "Sonar"} <= parts
    assert not {part for part in parts if part.startswith("R")}
    assert len(failures) == len(set(failures)) >= 120


def test_a_part_that_there_is_not_is_refused(folder: Path) -> None:
    said = " ".join(sweep(folder, "rests.xml", "--part", "Knee", code=1).split())
    assert "there is no part Knee that can fail; there are HeadYaw" in said
