"""Trials of a document beside others, each with a robot in one world."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.documents import document, state, sub
from visualhfsm.trials import Plan, Spread, Success, TrialsError
from visualhfsm.trials._series import LocalPool, Series
from visualhfsm.trials._trial import run_trial

pytestmark = pytest.mark.sim

WALK = """<iceinterface><nameinterface>Walk</nameinterface><nameproxy>Walk</nameproxy>
<interface>Walk</interface></iceinterface>"""
WORLD = """
[[robots]]
name = "first"
position = [-1.0, 0.0]

[[robots]]
name = "second"
position = [1.0, 0.0]
heading = 3.14159265
"""
JUDGE = """
def met(run):
    x, y, z = run.robot.device.stage.truth().objects["second"].position
    return "walked" if x < 0.95 else "stands"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "team"
    folder.mkdir()
    (folder / "pair.toml").write_text(WORLD)
    (folder / "judge.py").write_text(JUDGE)
    (folder / "stands.xml").write_text(document(sub(1, 0, state(1, "stands", initial=True))))
    for name, code in {
        "walks": "begun = begun or not self.Walk.walkTo(0.5, 0.0, 0.0)",
        "fails": "1 / 0",
    }.items():
        only = sub(1, 0, state(1, name, code, initial=True), variables="begun = False")
        (folder / f"{name}.xml").write_text(document(only, config=WALK))
    return folder


def plan(folder: Path, *others: str, **fields: object) -> Plan:
    values = {"document": str(folder / "stands.xml"), "scene": {"world": "pair.toml"}, **fields}
    return Plan(others=others, camera="drawn", limit=2.0, **values)  # type: ignore[arg-type]


def test_another_document_drives_the_other_robot_of_its_world(folder: Path) -> None:
    outcome = run_trial(plan(folder, "walks.xml", success=Success(function="judge.py:met")), 1)
    assert outcome.reason == "walked"
    assert outcome.states == "stands"
    alone = run_trial(plan(folder, "stands.xml", success=Success(function="judge.py:met")), 1)
    assert alone.reason == "stands"


def test_it_is_the_same_in_every_process(folder: Path) -> None:
    varied = plan(
        folder,
        "walks.xml",
        scene={"world": "pair.toml", "noise": True, "second.y": Spread(lowest=-0.1, highest=0.1)},
        numbers={"x": "judge.py:place"},
        runs=2,
    )
    (folder / "judge.py").write_text(
        'def place(run):\n    return run.robot.device.stage.truth().objects["second"].position[0]\n'
    )
    here = [run_trial(varied, number) for number in varied.trials]
    with LocalPool(2) as pool:
        there = [*Series(varied).outcomes(varied.trials, pool)]
    assert sorted(there, key=lambda outcome: outcome.number) == here
    assert here[0].numbers["x"] != here[1].numbers["x"] < 0.95


def test_an_error_of_another_fails_the_trial_with_its_place(folder: Path) -> None:
    outcome = run_trial(plan(folder, "fails.xml"), 1)
    assert outcome.reason.endswith("raised ZeroDivisionError: division by zero")
    assert "fails.xml" in outcome.error


@pytest.mark.parametrize(
    ("others", "fields", "message"),
    [
        (
            ("walks.xml",),
            {"robot": "fake", "scene": {}},
            'one world for several robots only with robot = "sim"',
        ),
        (("walks.xml", "walks.xml"), {}, "others: there are 3 documents for 2 robots in the world"),
    ],
)
def test_others_without_a_robot_are_refused(
    folder: Path, others: tuple[str, ...], fields: dict[str, object], message: str
) -> None:
    with pytest.raises(TrialsError, match=message):
        run_trial(plan(folder, *others, **fields), 1)
