"""Why tests failed, in the language of the page: the sentences of `run_until`, whole and in order."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hfsm_runtime.virtual import BehaviorFailed, Execution
from tests.support.documents import document, state, sub
from visualhfsm._base.languages import said
from visualhfsm._base.recognition import reason_of
from visualhfsm.simulation import Behavior, simulate


@pytest.fixture
def waits(tmp_path: Path) -> Iterator[Behavior]:
    (tmp_path / "waits.xml").write_text(
        document(sub(1, 0, state(1, "waiting", initial=True), state(2, "done")))
    )
    with simulate(tmp_path / "waits.xml") as behavior:
        yield behavior


def soon(_: object) -> bool:
    return False


@pytest.mark.parametrize(
    ("condition", "english", "spanish"),
    [
        (
            "done",
            "the state done was not reached within 0.2 s: at 0.200 s the behavior is in waiting",
            "no se alcanzó el estado done en 0,2 s: a los 0,200 s el comportamiento está en waiting",
        ),
        (
            soon,
            "soon did not hold within 0.2 s: at 0.200 s the behavior is in waiting",
            "no se cumplió soon en 0,2 s: a los 0,200 s el comportamiento está en waiting",
        ),
        (
            lambda: False,
            "the condition did not hold within 0.2 s: at 0.200 s the behavior is in waiting",
            "no se cumplió la condición en 0,2 s: a los 0,200 s el comportamiento está en waiting",
        ),
    ],
)
def test_what_did_not_happen_in_time_is_a_sentence(
    waits: Behavior, condition: str | Callable[[], bool], english: str, spanish: str
) -> None:
    with pytest.raises(BehaviorFailed) as failure:
        waits.run_until(condition, limit=0.2)
    reason, _, _ = str(failure.value).partition("\ntimeline of ")
    message = reason_of(f"test_waits.py:6: BehaviorFailed: {reason}")
    assert message == f"test_waits.py:6: {english}"
    assert said(message, "es") == f"test_waits.py:6: {spanish}"


@pytest.mark.parametrize(
    ("steer", "english", "spanish"),
    [
        (Execution.pause, "is paused in", "está en pausa en"),
        (Execution.request_stop, "has ended in", "ha terminado en"),
    ],
)
def test_what_a_paused_or_ended_behavior_did_not_reach_says_so(
    waits: Behavior, steer: Callable[[Execution], None], english: str, spanish: str
) -> None:
    steer(waits)
    with pytest.raises(BehaviorFailed) as failure:
        waits.run_until("done")
    reason, _, _ = str(failure.value).partition("\ntimeline of ")
    message = reason_of(reason)
    assert message == f"the state done was not reached: at 0.000 s the behavior {english} waiting"
    assert (
        said(message, "es")
        == f"no se alcanzó el estado done: a los 0,000 s el comportamiento {spanish} waiting"
    )


def test_any_other_reason_stays_as_it_is() -> None:
    for text in ("test_walk.py:3: assert 1 == 2", "walk.py cannot be read:\nline 1", "at 3 s the behavior"):
        assert reason_of(text) == text
        assert said(reason_of(text), "es") == text
