"""Exercises in which other robots play: their documents are the teacher's, and pupils get a copy of each."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.documents import document, state, sub
from visualhfsm_classes import Grader, GradingError, read_exercise
from visualhfsm_classes._handout import handout

EXERCISE = """
title = { en = "Watch" }

[[criteria]]
asks = { en = "Where the rival is" }
points = 1
judge = "judge.py:where"
"""
TRIALS = """
camera = "drawn"
others = ["rival.xml"]
runs = 1
limit = 2
scene.world = "pair.toml"
"""
WORLD = """
[[robots]]
name = "red1"
position = [-1.0, 0.0]

[[robots]]
name = "blue1"
position = [1.0, {y}]
"""
JUDGE = """
def where(run):
    first, last = (moment.things["blue1"] for moment in (run.moments[0], run.moments[-1]))
    own = run.moments[-1].place[0] - run.moments[0].place[0]
    return 1.0, f"begins at {first[1]:.0f} m, walks: {last[0] - first[0] > 0.03}, the pupil's: {own > 0.03}"
"""
WALK = (
    "<iceinterface><nameinterface>Walk</nameinterface><nameproxy>Walk</nameproxy>"
    "<interface>Walk</interface></iceinterface>"
)
STANDS = document(sub(1, 0, state(1, "stands", initial=True)))
WALKS = document(
    sub(1, 0, state(1, "walks", "begun = begun or not self.Walk.walkTo(0.5, 0.0, 0.0)", initial=True),
        variables="begun = False"),
    config=WALK,
)  # fmt: skip
RIVAL = document(
    sub(1, 0, state(1, "plays", initial=True, child=2)),
    '<SubAutomata id="2" idFather="1"><import>legs.xml</import></SubAutomata>',
    config=WALK,
)


def write(folder: Path, **files: str) -> Path:
    folder.mkdir()
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(text, "utf-8")
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write(
        tmp_path / "watch", exercise__toml=EXERCISE, trials__toml=TRIALS, judge__py=JUDGE, task__en__md="Watch.\n",
        pair__toml=WORLD.format(y=1.0), rival__xml=RIVAL, legs__xml=WALKS,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.sim
def test_rival_and_world_are_the_teachers_whatever_is_handed_in(folder: Path, tmp_path: Path) -> None:
    handed_in = write(
        tmp_path / "ana", watch__xml=RIVAL, rival__xml=STANDS, legs__xml=STANDS, pair__toml=WORLD.format(y=3.0)
    )  # fmt: skip
    grader = Grader(read_exercise(folder), handed_in / "watch.xml", "en", unsafe=False)
    marks = grader.grade("ana")
    assert marks.error == ""
    assert marks.earned[0].words == "begins at 1 m, walks: True, the pupil's: False"
    grader.record(marks, tmp_path / "worst.mcap")
    assert (tmp_path / "worst.mcap").stat().st_size > 0


def test_a_rival_that_cannot_run_is_no_fault_of_a_submission(folder: Path, tmp_path: Path) -> None:
    (folder / "rival.xml").write_text("<VisualHFSM>", "utf-8")
    path = write(tmp_path / "ana", watch__xml=STANDS) / "watch.xml"
    with pytest.raises(GradingError, match=r"the exercise watch: rival\.xml"):
        Grader(read_exercise(folder), path, "en", unsafe=True).grade("ana")


def test_pupils_get_the_rival_with_what_it_imports_and_the_world(folder: Path) -> None:
    files = handout(read_exercise(folder), "en")
    assert {*files} == {"task.md", "watch.xml", "watch.trials.toml", "rival.xml", "legs.xml", "pair.toml"}
    assert files["rival.xml"] == RIVAL.encode()


@pytest.mark.parametrize("file", ["rival.xml", "pair.toml"])
def test_a_rival_or_a_world_that_is_missing_is_named(folder: Path, file: str) -> None:
    (folder / file).unlink()
    with pytest.raises(GradingError, match=f"watch: there is no {file}, which the plan trials names"):
        read_exercise(folder)
