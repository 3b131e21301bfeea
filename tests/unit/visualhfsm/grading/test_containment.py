"""A contained submission: its trials are those of the same document outside."""

from __future__ import annotations

from pathlib import Path

from tests.support.documents import document, state, sub, transition
from visualhfsm.grading import Containment
from visualhfsm.trials import Plan, Success
from visualhfsm.trials._trial import run_trial


def test_a_contained_trial_has_the_outcome_of_any_other(tmp_path: Path) -> None:
    path = tmp_path / "waits.xml"
    waits = state(1, "waiting", "count += 1", initial=True)
    path.write_text(
        document(sub(1, 0, waits, state(2, "done"), transition(1, 1, 2, "count > 3"), variables="count = 0")),
        encoding="utf-8",
    )
    plan = Plan(document=str(path), robot="none", limit=2.0, success=Success(state="done"))
    with Containment(unsafe=True) as containment:
        assert run_trial(plan, 0, simulate=containment.simulate) == run_trial(plan, 0)


def test_a_contained_error_is_in_the_words_of_the_document_too(tmp_path: Path) -> None:
    path = tmp_path / "fails.xml"
    above = sub(1, 0, state(1, "play", initial=True, child=2), variables="count = 0")
    path.write_text(
        document(above, sub(2, 1, state(1, "look", "count += 1", initial=True))), encoding="utf-8"
    )
    plan = Plan(document=str(path), robot="none", limit=1.0)
    with Containment(unsafe=True) as containment:
        contained = run_trial(plan, 0, simulate=containment.simulate)
    assert "NameError: `count` is a variable of fails, and play has its own" in contained.reason
