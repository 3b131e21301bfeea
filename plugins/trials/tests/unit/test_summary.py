"""What a series of trials says."""

from __future__ import annotations

import csv
import io
import re
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from msgspec import structs
from rich.console import Console

from tests.support.present import present
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm.trials import Disturbance, Outcome, Plan, Spread, StateChange, TrialsError, Value
from visualhfsm_trials import Summary
from visualhfsm_trials._comparison import Comparison
from visualhfsm_trials._drawn import view_of
from visualhfsm_trials._page import origin_of, trials_page
from visualhfsm_trials._record import Header, Record
from visualhfsm_trials._summary import summarize, write_table
from visualhfsm_trials._terminal import show, show_comparison

VARYING = ("robot.x", "robot.y", "light")


def outcome(number: int) -> Outcome:
    """Return the outcome of a trial that fails far away, and where it is dark."""
    x, light = number / 100, ("dark", "bright")[number % 2]
    success = x < 0.5 and light == "bright"
    return Outcome(
        number=number,
        values={"robot.x": x, "robot.y": -x, "light": light, "noise": True},
        success=success,
        reason="" if success else "fell" if x >= 0.9 else "not in goal after 9 s",
        time=3.0 + x if success else 9.0,
        states="goal" if success else "search",
        numbers={"falls": float(x >= 0.9)},
        changes=(StateChange(0.0, "search"), StateChange(2.0, "goal"))
        if success
        else (StateChange(0.0, "search"),),
    )


def shown_of(summary: Summary | None, compared: Comparison | None = None, *, width: int = 100) -> str:
    """Return what the terminal shows of a series, and of two that are compared."""
    written = io.StringIO()
    console = Console(file=written, width=width)
    if summary is not None:
        show(console, summary, "walk")
    if compared is not None:
        show_comparison(console, compared, ("one", "other"))
    return written.getvalue()


@pytest.fixture
def summary() -> Summary:
    return Summary((outcome(number) for number in reversed(range(100))), VARYING)


def test_the_rate_has_its_interval(summary: Summary) -> None:
    assert (summary.rate.successes, summary.rate.trials) == (25, 100)
    assert summary.rate.lowest == pytest.approx(0.175, abs=1e-3)
    assert summary.rate.highest == pytest.approx(0.343, abs=1e-3)
    assert str(summary).splitlines() == [
        "25 of 100 succeed: 25 %  (17.5 to 34.3 %)",
        "  65 not in goal after 9 s in search",
        "  10 fell in search",
    ]


def test_failures_that_are_drawn_are_groups_of_success() -> None:
    breaks = Disturbance(at=1.0, fail=("HeadYaw", "HeadPitch"), kind=("stuck", "slow"))
    plan = Plan(disturbances={"breaks": breaks})
    outcomes = [
        structs.replace(outcome(number), values=(values := plan.draw(number)), success=works(values))
        for number in range(1, 41)
    ]
    shown = Summary(outcomes, plan.varying).dependences
    rates = {name: {part.label: part.rate for part in parts} for name, parts in shown.items()}
    assert {name: [*parts] for name, parts in rates.items()} == {
        "breaks.fail": ["HeadPitch", "HeadYaw"],
        "breaks.kind": ["slow", "stuck"],
    }
    pitch, yaw = rates["breaks.fail"]["HeadPitch"], rates["breaks.fail"]["HeadYaw"]
    assert pitch.successes == pitch.trials > 0
    assert 0 < yaw.successes < yaw.trials
    assert rates["breaks.kind"]["slow"].successes == rates["breaks.kind"]["slow"].trials > 0


def works(values: Mapping[str, Value]) -> bool:
    """Return whether a robot that must turn its head can do so with what fails."""
    return (values["breaks.fail"], values["breaks.kind"]) != ("HeadYaw", "stuck")


def test_ways_to_fail_that_are_not_named_are_counted() -> None:
    outcomes = [
        structs.replace(outcome(number), success=False, reason=f"fell into {chr(ord('a') + number)}")
        for number in range(9)
    ]
    *_, last = str(Summary(outcomes, VARYING)).splitlines()
    assert last == "  and 4 other ways"


def test_it_says_what_success_depends_on(summary: Summary) -> None:
    light = summary.dependences["light"]
    assert [(part.label, part.rate.successes, part.rate.trials) for part in light] == [
        ("bright", 25, 50),
        ("dark", 0, 50),
    ]
    places = [(part.label, part.rate.successes, part.rate.trials) for part in summary.dependences["robot.x"]]
    assert places == [
        ("0 to 0.198", 10, 20),
        ("0.198 to 0.396", 10, 20),
        ("0.396 to 0.594", 5, 20),
        ("0.594 to 0.792", 0, 20),
        ("0.792 to 0.99", 0, 20),
    ]


def test_it_says_how_the_numbers_of_the_plan_depend_on_it_too(summary: Summary) -> None:
    falls = [part.means["falls"] for part in summary.dependences["robot.x"]]
    assert falls == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.5])
    assert [*summary.dependences["light"][0].means] == ["falls"], "the plan does not ask for the time"


def test_a_quantity_with_ten_values_is_shown_by_each_of_them() -> None:
    trials = (structs.replace(outcome(n), values={"speed": n % 10 / 4}) for n in range(100))
    labels = [part.label for part in Summary(trials, ("speed",)).dependences["speed"]]
    assert labels == ["0", "0.25", "0.5", "0.75", "1", "1.25", "1.5", "1.75", "2", "2.25"]


@pytest.mark.parametrize(
    ("count", "labels"), [(10, ["0 to 1.12", "1.12 to 2.25"]), (4, ["0", "0.25", "0.5", "0.75"])]
)
def test_values_of_which_each_trial_has_its_own_are_joined(count: int, labels: list[str]) -> None:
    trials = (structs.replace(outcome(n), values={"speed": n / 4}) for n in range(count))
    parts = Summary(trials, ("speed",)).dependences["speed"]
    assert [part.label for part in parts] == labels
    assert {part.rate.trials for part in parts} == {count // len(labels)}


def test_trials_are_distinguished_by_their_groups() -> None:
    trials = (structs.replace(outcome(n), groups={"on": "back" if n < 30 else "belly"}) for n in range(100))
    parts = Summary(trials, VARYING).dependences["on"]
    assert [(part.label, part.rate.trials) for part in parts] == [("back", 30), ("belly", 70)]


def test_reasons_that_differ_in_figures_only_are_one_way_to_fail() -> None:
    trials = [
        structs.replace(outcome(n), success=False, states="", reason=f"the ball is at {n / 7:.2f} m")
        for n in range(9)
    ]
    (way,) = Summary(trials, VARYING).ways
    assert (way.reason, way.numbers) == ("the ball is at 0.00 m", [*range(9)])


def test_each_trial_is_in_one_range(summary: Summary) -> None:
    for parts in summary.dependences.values():
        assert sum(part.rate.trials for part in parts) == 100


def test_numbers_are_those_of_success(summary: Summary) -> None:
    assert summary.numbers["time"].least == pytest.approx(3.01)
    assert summary.numbers["time"].greatest == pytest.approx(3.49)
    assert summary.numbers["falls"].count == 25


def test_the_commonest_way_to_fail_comes_first_and_the_rarest_is_the_worst(summary: Summary) -> None:
    assert [(way.reason, way.states, len(way.numbers)) for way in summary.ways] == [
        ("not in goal after 9 s", "search", 65),
        ("fell", "search", 10),
    ]
    assert {row.reason for row in summary.worst} == {"fell"}
    assert [row.number for row in summary.worst] == [*range(90, 100)]


def test_places_are_a_map(summary: Summary) -> None:
    (found,) = summary.maps
    assert found.thing == "robot"
    assert found.places[3] == (0.03, -0.03, True, 3)
    assert Summary(map(outcome, range(10)), ("robot.x",)).maps == []  # a place has both


def test_the_order_in_which_trials_end_does_not_matter(summary: Summary) -> None:
    other = Summary(map(outcome, range(100)), VARYING)
    assert other.rows == summary.rows
    assert other.ways == summary.ways


def test_the_table_has_a_row_for_each_trial(summary: Summary, tmp_path: Path) -> None:
    write_table(tmp_path / "walk.csv", summary)
    rows = list(csv.DictReader(io.StringIO((tmp_path / "walk.csv").read_text("utf-8-sig"))))
    assert len(rows) == 100
    assert rows[3] == {
        "number": "3",
        "success": "true",
        "reason": "",
        "states": "goal",
        "robot.x": "0.03",
        "robot.y": "-0.03",
        "light": "bright",
        "noise": "true",
        "time": "3.03",
        "falls": "0.0",
    }


def test_a_table_that_somebody_changed_is_kept(summary: Summary, tmp_path: Path) -> None:
    table = tmp_path / "walk.csv"
    write_table(table, Summary(map(outcome, range(50)), VARYING))
    write_table(table, summary, summary)  # later trials add to it
    write_table(table, Summary(map(outcome, range(50)), VARYING), summary)  # and fewer may be asked for
    for changed in (
        table.read_text("utf-8-sig").replace("goal", "goal, by luck", 1),
        table.read_text("utf-8-sig").replace(",", ";"),
        "my notes",
    ):
        table.write_text(changed, "utf-8")
        with pytest.raises(VisualHfsmError, match="is kept"):
            write_table(table, summary, summary)
        assert table.read_text("utf-8") == changed
    write_table(table, summary)
    assert "luck" not in table.read_text("utf-8-sig")


def test_a_table_that_cannot_be_written_is_named(summary: Summary, tmp_path: Path) -> None:
    with pytest.raises(VisualHfsmError, match="the table cannot be written"):
        write_table(tmp_path / "nowhere" / "walk.csv", summary)


@pytest.mark.slow
def test_two_series_are_compared_trial_by_trial(summary: Summary) -> None:
    better = [
        Outcome(
            **{
                **{field: getattr(o, field) for field in Outcome.__struct_fields__},
                "success": True,
                "time": 2.5,
            }
        )
        for o in map(outcome, range(100))
        if o.number >= 2
    ]
    found = Comparison(summary, Summary(better, VARYING))
    assert found.only_first == []
    assert len(found.only_second) == 74
    assert found.chance < 1e-20
    assert found.verdict.startswith("74 gained, 0 lost: real (p = ")
    time = found.numbers["time"]
    assert time.difference.interval is not None
    low, high = time.difference.interval
    assert low < time.difference.mean < high < 0
    assert time.second == pytest.approx(2.5)
    assert found.difference.mean == 74 / 98
    assert (found.both, time.difference.count) == (24, 24)


def test_a_mean_of_times_differs_by_no_more_than_the_limit_and_what_is_rare_is_named() -> None:
    first = [structs.replace(outcome(n), success=True, time=1.0) for n in range(6)]
    times = (1.0, 1.01, 1.02, 1.03, 1.04, 9.0)
    second = [structs.replace(each, time=time) for each, time in zip(first, times, strict=True)]
    found = Comparison(Summary(first, VARYING), Summary(second, VARYING), limit=9.5)
    low, high = present(found.numbers["time"].difference.interval)
    assert -0.1 < low < 0.1
    assert (
        high
        < 9.5
        < present(Comparison(Summary(first, ()), Summary(second, ())).numbers["time"].difference.interval)[1]
    )
    text = shown_of(None, found, width=140)
    assert "(one number is far from the others)" in text
    assert "What happens in fewer than 39.3 % may be missing." in text  # 1 - 0.05 ** (1 / 6)


def test_the_same_series_twice_differs_in_nothing(summary: Summary) -> None:
    found = Comparison(summary, summary)
    assert (found.chance, found.verdict) == (1.0, "none: the same trials succeed")


def test_series_without_a_common_trial_are_not_compared(summary: Summary) -> None:
    with pytest.raises(TrialsError, match="no trial in common"):
        Comparison(summary, Summary([outcome(200)], VARYING))


def test_the_terminal_shows_all_of_it(summary: Summary) -> None:
    text = shown_of(summary, Comparison(summary, summary))
    for expected in (
        "walk  25 of 100 succeed: 25 %  (17.5 to 34.3 %)",
        "What it depends on, with the means of the numbers",
        "bright  ████░░░░  25 of 50",
        "not in goal after 9 s",
        "The worst: 90, 91, 92",
        "none: the same trials succeed",
    ):
        assert expected in text


@pytest.mark.parametrize(("width", "shown"), [(60, False), (80, True)])
def test_a_narrow_terminal_shows_fewer_numbers_instead_of_parts_of_them(
    summary: Summary, width: int, shown: bool
) -> None:
    text = shown_of(summary, width=width)
    _, _, table = text[: text.index("How it fails")].partition("What it depends on")
    assert ("falls" in table) is shown
    assert "…" not in table


def test_a_success_that_is_true_from_the_start_says_nothing(tmp_path: Path) -> None:
    trials = [
        structs.replace(outcome(n), success=True, reason="", time=0.0 if n < 6 else 1.0) for n in range(9)
    ]
    found = Summary(trials, VARYING)
    words = "Success is true from the start in 6 of 9: that says nothing."
    assert words in shown_of(found)
    assert words in str(found)
    view = view_of(Plan(document="walk.xml"), found, kept(tmp_path, 9))
    assert (view.from_start, view.equal) == (6, False)


def test_trials_that_fail_at_once_are_no_success_from_the_start() -> None:
    found = Summary([structs.replace(outcome(n), success=False, time=0.0) for n in range(9)], VARYING)
    assert found.warnings == []


def test_equal_trials_say_as_much_as_one_and_none_is_the_worst(tmp_path: Path) -> None:
    trials = [structs.replace(outcome(1), number=n, success=True, reason="") for n in range(1, 7)]
    found = Summary(trials, VARYING)
    text = shown_of(found)
    assert "The 6 trials are equal: they say as much as one." in text
    assert "The worst" not in text
    assert [row.number for row in found.worst] == [1]
    view = view_of(Plan(document="walk.xml"), found, kept(tmp_path, 9))
    assert (view.equal, len(view.worst)) == (True, 1)


@pytest.mark.parametrize("differs", [{"time": 3.5}, {"numbers": {"falls": 1.0}}, {"states": "search"}])
def test_trials_of_which_one_differs_are_not_equal(differs: dict[str, Any]) -> None:
    trials = [structs.replace(outcome(1), number=n) for n in range(1, 6)]
    found = Summary([*trials, structs.replace(outcome(1), number=6, **differs)], VARYING)
    assert not found.are_equal
    assert not Summary([outcome(1)], VARYING).are_equal
    assert "The worst: 1" in shown_of(Summary([outcome(1)], VARYING))


def test_numbers_are_shown_when_all_succeed() -> None:
    trials = (structs.replace(outcome(n), success=True) for n in range(20))
    text = shown_of(Summary(trials, VARYING))
    assert "What it depends on" in text
    assert "Parts with fewer than 20 trials may differ by chance." in text


def test_the_page_gets_the_means_and_the_numbers_of_the_worst(tmp_path: Path) -> None:
    file = kept(tmp_path, 100)
    view = view_of(Plan(document="walk.xml"), summarize(file, VARYING, 100), file)
    light = next(each for each in view.dependences if each.name == "light")
    assert light.parts[0].means == [("falls", 0.1)]
    assert ("falls", "1") in view.worst[0].values
    assert "time" not in dict(view.worst[0].values), "it stands beside the reason"


def kept(tmp_path: Path, outcomes: int) -> Path:
    file = tmp_path / "walk.outcomes.jsonl"
    with Record(file, Header("walk.xml", "", {})) as record:
        for number in range(outcomes):
            record.add(outcome(number))
    return file


def test_the_view_has_a_timeline_of_each_way_and_of_the_worst(tmp_path: Path) -> None:
    file = kept(tmp_path, 100)
    plan = Plan(document="walk.xml", runs=120, scene={"robot.x": Spread(lowest=0, highest=1)})
    view = view_of(plan, summarize(file, VARYING, 120), file, {95: "walk/95.html"})
    assert (view.name, view.planned, view.share.successes, view.share.trials) == ("walk", 120, 25, 100)
    assert [(way.reason, way.count, way.timeline.number) for way in view.ways] == [
        ("not in goal after 9 s", 65, 0),
        ("fell", 10, 90),
    ]
    assert [trial.page for trial in view.worst].count("walk/95.html") == 1
    (times, falls) = view.histograms
    assert (times.name, falls.name) == ("time", "falls")
    assert sum(times.good) == 25
    assert sum(times.bad) == 75


def test_the_page_is_one_file_without_a_network(tmp_path: Path) -> None:
    file = kept(tmp_path, 20)
    page = trials_page(view_of(Plan(document="<b>.xml"), summarize(file, VARYING, 20), file))
    assert "default-src 'none'" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "<title>&lt;b&gt;</title>" in page


@pytest.mark.slow
def test_a_page_says_what_its_figures_are_of(tmp_path: Path) -> None:
    file = kept(tmp_path, 3)
    plan = Plan(document=str(tmp_path / "walk.xml"), seed=7)
    found = origin_of(plan, file)
    assert found is not None
    assert (found.document, found.seed, found.commit) == ("walk.xml", 7, "")
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b.example"]
    for command in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "trials"]):
        subprocess.run([*git, *command], check=True)
    committed = present(origin_of(plan, file)).commit
    assert re.fullmatch("[0-9a-f]{12}", committed)
    file.touch()
    (tmp_path / "walk.xml").write_text("changed")
    assert present(origin_of(plan, file)).commit == f"{committed}+"


def test_a_page_of_a_thousand_trials_is_small(tmp_path: Path) -> None:
    file = kept(tmp_path, 1000)
    page = trials_page(view_of(Plan(document="walk.xml"), summarize(file, VARYING, 1000), file))
    assert len(page) < 2e6


@pytest.mark.slow
def test_of_trials_that_were_added_after_a_look_no_difference_is_called_real(summary: Summary) -> None:
    better = [structs.replace(outcome(number), success=number < 90) for number in range(100)]
    first = Summary((outcome(number) for number in range(100)), VARYING)
    assert "lost: real (p = " in Comparison(first, Summary(better, VARYING, (100,))).verdict
    grown = Comparison(Summary(first_of(better), VARYING, (40, 100)), Summary(better, VARYING, (100,)))
    assert grown.looks == 2
    assert grown.verdict == "5 gained, 0 lost: p = 0.0625 of a single look, at most 0.125 of 2 looks"
    text = shown_of(Summary(better, VARYING, (40, 100)), grown, width=120)
    assert "Trials were added after a look (40, then 100): the interval is that of a single look." in text
    assert "Fresh trials, of another --seed, are looked at once." in text


def first_of(outcomes: list[Outcome]) -> list[Outcome]:
    """Return outcomes of which five fewer succeed."""
    return [structs.replace(each, success=each.success and each.number >= 5) for each in outcomes]


@pytest.mark.slow
def test_of_many_parts_some_differ_by_chance(summary: Summary) -> None:
    text = shown_of(summary, width=120)
    assert "Of 12 parts, some differ by chance alone." in text
    assert "Means are of all trials of a part, failed ones, too." in text


@pytest.mark.slow
def test_few_trials_are_called_few() -> None:
    few, enough = (Summary((outcome(number) for number in range(count)), VARYING) for count in (19, 20))
    text = shown_of(few, Comparison(few, few), width=120)
    assert "%)\nFewer than 20 trials say little." in text
    assert "in which both succeed. Fewer than 20 trials say little." in text
    assert "say little" not in shown_of(enough, width=120)
