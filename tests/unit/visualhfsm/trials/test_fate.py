"""Trials in which a part of the robot fails: which one, and what becomes of the behavior."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.documents import document, state, sub, transition
from visualhfsm.trials import Outcome, Plan, Success, TrialsError
from visualhfsm.trials._trial import run_trial

WALKS = "self.Motors.setV(0.1)"
CONFIG = "".join(
    f"<iceinterface><nameinterface>{name}</nameinterface><nameproxy>{name}</nameproxy><ip>localhost</ip>"
    f"<port>7447</port><interface>{name}</interface></iceinterface>"
    for name in ("Motors", "Battery", "Speech")
)
IS_LOW = "self.Battery.getBatteryReading().charge < 0.1"


def run(tmp_path: Path, then: str, *, number: int = 1, goal: str | None = None, **fields: object) -> Outcome:
    """Run a behavior that walks, and does something else when the battery is low."""
    path = tmp_path / "walks.xml"
    text = document(
        sub(
            1,
            0,
            state(1, "walking", WALKS, initial=True),
            state(2, "then", then),
            state(3, "there"),
            transition(1, 1, 2, IS_LOW),
        ),
        config=CONFIG,
    )
    path.write_text(text, "utf-8")
    given = {"failures": ("Battery low",), "fails_at": 1.0, "limit": 6.0, "robot": "fake", **fields}
    return run_trial(Plan(document=str(path), success=Success(state=goal), **given), number)  # type: ignore[arg-type]


def test_each_failure_has_its_turn(tmp_path: Path) -> None:
    failures = ("HeadYaw stuck", "Camera black", "Battery low")
    found = [
        run(tmp_path, "pass", number=number, failures=failures, limit=0.1).values["failure"]
        for number in (1, 2, 3, 4)
    ]
    assert found == [*failures, failures[0]]


@pytest.mark.parametrize(
    ("then", "goal", "fate"),
    [
        ("self.Motors.setV(0.0)", None, "stopped"),
        ("raise RuntimeError('no power')", None, "stopped"),
        (WALKS, None, "succeeded"),
        (WALKS, "there", "failed"),
        ("self.Motors.setV(0.0)\nself.sleep(60.0)", None, "hung"),
    ],
)
def test_what_becomes_of_a_behavior(tmp_path: Path, then: str, goal: str | None, fate: str) -> None:
    assert run(tmp_path, then, goal=goal).groups["fate"] == fate


@pytest.mark.parametrize("failure", ["Server hung", "Link deaf", "Link mute", "Link late", "Link lossy"])
def test_who_waits_for_the_limit_of_a_call_over_a_failing_link_does_not_hang(
    tmp_path: Path, failure: str
) -> None:
    outcome = run(tmp_path, "pass", failures=(failure,))
    assert not outcome.error
    assert outcome.time == pytest.approx(6.0)
    assert outcome.groups["fate"] in {"stopped", "succeeded"}


@pytest.mark.sim
def test_a_robot_whose_knees_are_limp_falls(tmp_path: Path) -> None:
    outcome = run(tmp_path, "pass", robot="sim", camera="drawn", failures=("LKneePitch limp",))
    assert outcome.groups["fate"] == "fell"
    assert outcome.reason == "fell"


def test_how_long_it_walks_on_without_a_word(tmp_path: Path) -> None:
    said = "self.Speech.say('low')\n" + WALKS
    silent, spoken = (run(tmp_path, then).numbers["walks on"] for then in (WALKS, said))
    assert silent == pytest.approx(5.0, abs=0.3)
    assert spoken < 1.5


def test_what_cannot_fail_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(TrialsError, match="Knee cannot fail: there is no part 'Knee'"):
        run(tmp_path, "pass", failures=("Knee stuck",), fails_at=100.0)
