"""Our exercises: their solutions earn all points, and their mistakes what they are expected to earn."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import msgspec
import pytest

from tests.support.places import ROOT
from visualhfsm_classes import Exercise, Grader, read_exercise

EXERCISES = {
    path.parent.name: read_exercise(path.parent) for path in (ROOT / "exercises").glob("*/exercise.toml")
}
PHYSICS = {
    name for name, each in EXERCISES.items() if any(plan.robot == "sim" for plan in each.plans.values())
}


IN_TEST: Final = {
    *(f"{name}-solution" for name in ("look", "nod", "notice", "wake_up", "walk")), "look-no_way_back", "walk-degrees",
}  # fmt: skip
"""What is graded in `make test`: what takes long, as the walks to balls and goals do, is graded in `make soak`."""
MISTAKES: Final = {"notice": 4}
"""The typical mistakes of exercises that have more than three."""


def documents() -> Iterator[object]:
    for name in sorted(EXERCISES):
        of_physics = [pytest.mark.slow, pytest.mark.sim, pytest.mark.gl] if name in PHYSICS else []
        for mistake in ("", *sorted(EXERCISES[name].mistakes)):
            named = f"{name}-{mistake or 'solution'}"
            soaks = [] if named in IN_TEST else [pytest.mark.soak]
            yield pytest.param(name, mistake, id=named, marks=[*of_physics, *soaks])


def points(exercise: Exercise, mistake: str, tmp_path: Path) -> float:
    path = exercise.mistake(mistake) if mistake else exercise.solution
    alone = tmp_path / path.name
    alone.write_bytes(path.read_bytes())
    return Grader(exercise, alone, "en", unsafe=True).grade(path.stem).points


@pytest.mark.slow
@pytest.mark.parametrize(("name", "mistake"), list(documents()))
def test_each_document_earns_what_is_expected(name: str, mistake: str, tmp_path: Path) -> None:
    """With physics one trial of each plan must do: `visualhfsm grade NAME --check` runs all."""
    exercise = EXERCISES[name]
    if name not in PHYSICS:
        assert points(exercise, mistake, tmp_path) == (
            exercise.mistakes[mistake] if mistake else exercise.points
        )
        return
    plans = {key: msgspec.structs.replace(plan, runs=1) for key, plan in exercise.plans.items()}
    earned = points(msgspec.structs.replace(exercise, plans=plans), mistake, tmp_path)
    assert earned < exercise.points if mistake else earned == exercise.points


@pytest.mark.parametrize("name", sorted(EXERCISES))
def test_every_exercise_is_complete(name: str) -> None:
    exercise = EXERCISES[name]
    assert exercise.languages == ("en", "es")
    assert len(exercise.mistakes) == MISTAKES.get(name, 3)
    assert all(earned < exercise.points for earned in exercise.mistakes.values())
    mistakes = (exercise.folder / "mistakes").glob("*.xml")
    assert sorted(exercise.mistakes) == sorted(path.stem for path in mistakes)
    assert sum(plan.runs for plan in exercise.plans.values()) <= 5
