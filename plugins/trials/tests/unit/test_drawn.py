"""What the page gets of trials, whose texts come from code of users."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from visualhfsm.trials import Outcome, Plan, StateChange
from visualhfsm_trials._drawn import view_of
from visualhfsm_trials._record import Header, Record
from visualhfsm_trials._summary import summarize


def written(path: Path, outcomes: list[Outcome]) -> Path:
    with Record(path, Header("walk.xml", "", {})) as record:
        for each in outcomes:
            record.add(each)
    return path


def placed(number: int, **fields: object) -> Outcome:
    values = {"robot.x": number / 7, "robot.y": -number / 11}
    given = {"number": number, "values": values, "success": number % 3 == 0, "reason": "fell", "time": 1.0}
    return Outcome(**{**given, **fields})  # type: ignore[arg-type]


def test_ten_thousand_trials_are_a_small_message(tmp_path: Path) -> None:
    file = written(tmp_path / "out", [placed(number) for number in range(10_000)])
    varying = ("robot.x", "robot.y")
    view = view_of(Plan(document="walk.xml", robot="fake"), summarize(file, varying, 10_000), file)
    (found,) = view.maps
    assert found.trials == view.share.trials == 10_000
    assert 1000 <= len(found.places) <= 2000
    assert len(msgspec.json.encode(view, enc_hook=str)) < 100_000


@pytest.mark.slow
def test_long_and_many_texts_are_cut(tmp_path: Path) -> None:
    changes = tuple(StateChange(float(time), "s" * 1000) for time in range(200))
    outcomes = [
        placed(
            number,
            reason=chr(97 + number) * 50_000,
            states="s" * 50_000,
            changes=changes,
            values={f"q{each}": "v" * 5000 for each in range(300)},
            numbers={f"n{each}" * 500: float(number) for each in range(300)},
            success=False,
        )
        for number in range(20)
    ]
    file = written(tmp_path / "out", outcomes)
    view = view_of(Plan(document="walk.xml", robot="fake"), summarize(file, ("q1",), 20), file)
    assert len(view.ways) == 12
    assert len(msgspec.json.encode(view, enc_hook=str)) < 1 << 21


@pytest.mark.parametrize(
    ("reason", "template"),
    [
        ("fell", "fell"),
        ("not in wave/up after 2.5 s", "not in {state} after {time} s"),
        ("ended before done", "ended before {state}"),
        ("judged not good", "judged not good"),
        ("took more than 60 s", "took more than {time} s"),
        ("needs more than 512 MB of memory", "needs more than {memory} MB of memory"),
        ("NameError: name 'x' is not defined", "{kind}: {what}"),
        (
            "the code of walk raised IndexError: list index out of range",
            "the code of {automaton} raised {error}",
        ),
        ("sys.exit(1) ends the component", "{what} ends the component"),
    ],
)
def test_why_a_trial_fails_can_be_translated(tmp_path: Path, reason: str, template: str) -> None:
    file = written(tmp_path / "out", [placed(1, reason=reason)])
    view = view_of(Plan(document="walk.xml", robot="fake"), summarize(file, (), 2), file)
    for found in (view.ways[0].reason, view.worst[0].reason):
        assert found == reason
        data = found.to_data()
        assert isinstance(data, dict)
        assert data["template"] == template


def test_a_number_that_is_the_same_in_all_trials_is_not_drawn(tmp_path: Path) -> None:
    outcomes = [placed(number, time=2.0 + number * 1e-9, numbers={"way": number}) for number in range(5)]
    file = written(tmp_path / "out", outcomes)
    view = view_of(Plan(document="walk.xml"), summarize(file, (), 5), file)
    assert [each.name for each in view.histograms] == ["way"]


def test_lines_of_the_field_are_as_the_field_has_them(tmp_path: Path) -> None:
    file = written(tmp_path / "out", [placed(0)])
    plan = Plan(document=str(tmp_path / "walk.xml"), scene={"world": "soccer"})
    (found,) = view_of(plan, summarize(file, ("robot.x", "robot.y"), 1), file).maps
    assert found.lines
    straight = [(x == end_x) != (y == end_y) for x, y, end_x, end_y in found.lines]
    assert all(straight)
    assert {(-x, y, -end_x, end_y) for x, y, end_x, end_y in found.lines if x == end_x and x > 1} <= {
        *found.lines
    }
