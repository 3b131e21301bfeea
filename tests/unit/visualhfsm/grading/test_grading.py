"""Our exercises: their solutions earn all points, and their mistakes what they are expected to earn."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.places import ROOT
from visualhfsm.grading import Grader, read_exercise

EXERCISES = sorted(path.parent.name for path in (ROOT / "exercises").glob("*/exercise.toml"))
CASES = [
    (name, mistake)
    for name in EXERCISES
    for mistake in ("", *sorted(read_exercise(ROOT / "exercises" / name).mistakes))
]


@pytest.mark.parametrize(("name", "mistake"), CASES)
def test_each_document_earns_what_is_expected(name: str, mistake: str) -> None:
    exercise = read_exercise(ROOT / "exercises" / name)
    path = exercise.mistake(mistake) if mistake else exercise.solution
    marks = Grader(exercise, path, "en", unsafe=True).grade(path.stem)
    assert marks.points == (exercise.mistakes[mistake] if mistake else exercise.points), marks


@pytest.mark.parametrize("name", EXERCISES)
def test_every_exercise_is_complete(name: str) -> None:
    exercise = read_exercise(ROOT / "exercises" / name)
    assert exercise.languages == ("en", "es")
    assert len(exercise.mistakes) == 3
    assert all(points < exercise.points for points in exercise.mistakes.values())
    assert sorted(exercise.mistakes) == sorted(
        path.stem for path in Path(exercise.folder, "mistakes").glob("*.xml")
    )
    assert sum(plan.runs for plan in exercise.plans.values()) <= 5
