"""Test: in virtual time, by recordings, by proofs and by a hundred trials."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.model_checker import check_model, report_model
from tests.doors.conftest import ServedRobot
from tests.support.commands import run_here
from tests.support.documents import compile_to, document, state, sub, transition
from tests.support.limits import RUN_LIMIT
from tests.support.model_documents import stated
from tests.support.pages import blocks_of, sections_of
from tests.support.places import ROOT
from tests.support.plugins import needs
from tests.support.processes import ComponentProcess
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app

pytest_plugins = "pytester"

TURNING = document(
    sub(
        1,
        0,
        state(1, "left", "self.head.setSpeed(0.4, 0.0)", initial=True),
        state(2, "right", "self.head.setSpeed(-0.4, 0.0)"),
        transition(1, 1, 2, "self.head.getPose().pan > 0.15", name="far"),
        transition(2, 2, 1, "400", type="time", name="back"),
        period="40",
    ),
    config=(
        "<iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy>"
        "<interface>PoseHead</interface></iceinterface>"
    ),
)
PLAN = """
robot = "fake"
runs = 12
limit = 3

[scene]
BallGreen.pan = { from = -0.4, to = 0.4 }

[disturbances.carried]
at = { from = 1, to = 3 }
move = "BallGreen"
to = { pan = 3.1 }

[success]
state = "search"
"""


def visualhfsm(folder: Path, *words: str) -> str:
    done = run_here(app, "visualhfsm", *words, cwd=folder, expected=(VisualHfsmError,), columns=100)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.promise("**Test** with pytest in virtual time")
def test_the_test_of_the_readme_passes(pytester: pytest.Pytester) -> None:
    blocks = blocks_of((ROOT / "README.md").read_text("utf-8"))
    (shown,) = [block.text for block in blocks if block.language == "python" and "def test_" in block.text]
    (pytester.path / "behaviors").symlink_to(ROOT / "behaviors")
    pytester.makepyfile(test_readme=shown)
    pytester.runpytest_inprocess("-p", "no:cacheprovider", "-p", "no:anyio").assert_outcomes(passed=1)


@pytest.mark.promise("record, replay")
def test_a_recording_replays_identically(fake: ServedRobot, tmp_path: Path) -> None:
    file, recording = compile_to(tmp_path, TURNING, "turner"), tmp_path / "run.mcap"
    command = [sys.executable, str(file), "--record", str(recording), "--seconds", "1.2", "--clock", "wall"]
    with ComponentProcess(command, {**fake.environment, "PYTHONPATH": str(ROOT)}) as component:
        assert component.wait(RUN_LIMIT) == 0, component.output
    said = visualhfsm(tmp_path, "replay", str(recording))
    assert "run.mcap: turner, recorded on 20" in said
    assert "cycles, identical" in said


@pytest.mark.promise("prove properties")
def test_a_property_that_does_not_hold_has_the_counterexample_that_is_shown() -> None:
    sections = {section.title: section for section in sections_of("explanation/model-checker.md")}
    block = next(block for block in sections["Properties"].blocks if block.language == "xml")
    diagnostics = Diagnostics()
    light = parse_document(block.text, Path("light.xml"), diagnostics)
    assert light is not None
    late = stated("eventually", "day/lamp/green", "2900", "late")
    report_model(check_model(replace(light, properties=(late,)), Path("light.xml")), diagnostics)
    (found,) = diagnostics
    message, *steps = sections["Verdicts"].blocks[-1].text.splitlines()
    assert found.message == message
    assert found.notes[0].message.splitlines()[1:] == steps


@needs("visualhfsm_trials")
@needs("visualhfsm_trials")
@pytest.mark.promise("run a hundred trials and see what success depends on")
def test_a_series_of_trials_is_kept_shown_and_not_computed_twice(tmp_path: Path) -> None:
    (tmp_path / "follow_ball.xml").write_bytes((ROOT / "behaviors" / "follow_ball.xml").read_bytes())
    (tmp_path / "follow_ball.trials.toml").write_text(PLAN, encoding="utf-8")
    printed = visualhfsm(tmp_path, "trials", "follow_ball.xml", "--workers", "1")
    rate = re.search(r"follow_ball +(\d+) of 12 succeed: ", printed)
    assert rate
    assert 0 < int(rate[1]) < 12
    assert "not in search after 3 s" in printed
    assert len((tmp_path / "follow_ball.outcomes.csv").read_text().splitlines()) == 13
    again = visualhfsm(tmp_path, "trials", "follow_ball.xml")
    assert "goes on with the 12 outcomes there" in again
    assert again.endswith(printed[printed.index("follow_ball  ") :])
