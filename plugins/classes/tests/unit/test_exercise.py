"""Exercises as they are written: what is read, and what is refused, with its place."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.support.places import ROOT
from visualhfsm.trials import TrialsError
from visualhfsm_classes import GradingError, read_exercise
from visualhfsm_classes._handout import handout


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROOT / "exercises/nod", tmp_path / "nod"))


def change(folder: Path, old: str, new: str, file: str = "exercise.toml") -> None:
    text = (folder / file).read_text("utf-8")
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1), "utf-8")


def test_an_exercise_is_read(folder: Path) -> None:
    exercise = read_exercise(folder)
    assert (exercise.name, exercise.languages, exercise.points) == ("nod", ("en", "es"), 10.0)
    assert exercise.title["es"] == "Di que sí tres veces"
    assert {name: plan.runs for name, plan in exercise.plans.items()} == {"trials": 1, "hidden/other": 3}
    assert exercise.language("es") == "es"
    assert exercise.language("fr") == "en"


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ("points = 5", "points = 0", r"exercise.toml:9: criteria\[0\].points = 0: write points above 0"),
        ("points = 5", "marks = 5", r"exercise.toml:9: criteria\[0\].marks: there is no such key"),
        ('state = "done"', "", r"exercise.toml:.*: a criterion has either state or judge"),
        ('state = "done"', 'state = "done"\njudge = "judge.py:nods"', "either state or judge"),
        ('state = "done"', 'state = "done"\nafter = "push"', "the plan trials has no disturbance push"),
        (
            'state = "done"',
            'state = "done"\ntrials = ["hidden/far"]',
            "there is no plan hidden/far; there is",
        ),
        ('es = "Después pasa', 'fr = "Ensuite', r"criteria\[1\].asks: it has no words in es"),
        ("one_too_many", "two_too_many", "mistakes.two_too_many: there is no .*two_too_many.xml"),
        ('es = "Di', 'de = "Di', "title.de: there is no task.de.md"),
    ],
)
def test_what_is_wrong_is_named(folder: Path, old: str, new: str, error: str) -> None:
    change(folder, old, new)
    with pytest.raises(GradingError, match=error):
        read_exercise(folder)


def test_it_is_said_for_which_robots_it_is(folder: Path) -> None:
    change(folder, ', "T1", "G1", "Cart"', "")
    task = handout(read_exercise(folder), "en")["task.md"].decode()
    assert "\nIt is made for robots with the body H25, H21.\n\n" in task
    change(folder, "[success]", '[scene]\nbody = "Cart"\n[success]', "trials.toml")
    with pytest.raises(
        GradingError, match="the plan trials has the body Cart, and the exercise is for H25, H21"
    ):
        read_exercise(folder)


def test_a_plan_calls_no_functions_which_could_be_the_pupils(folder: Path) -> None:
    change(folder, 'state = "done"', 'function = "judge.py:nods"', "trials.toml")
    with pytest.raises(GradingError, match="write a criterion with judge"):
        read_exercise(folder)


def test_a_plan_is_read_as_strictly(folder: Path) -> None:
    change(folder, "runs = 1", "runs = 0", "trials.toml")
    with pytest.raises(TrialsError, match=r"trials.toml:2: runs = 0"):
        read_exercise(folder)


@pytest.mark.parametrize("file", ["exercise.toml", "trials.toml", "task.es.md"])
def test_a_missing_file_is_named(folder: Path, file: str) -> None:
    (folder / file).unlink()
    with pytest.raises(GradingError, match=f"there is no {file}"):
        read_exercise(folder)
