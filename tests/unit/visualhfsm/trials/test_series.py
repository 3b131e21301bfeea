"""Series of trials in processes: the same outcomes on any number of them, and whatever happens to them."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import msgspec
import psutil
import pytest

from tests.support.documents import document, state, sub, transition
from visualhfsm.trials import Outcome, Plan, Spread, Success, TrialsError, run_trials
from visualhfsm.trials._outcomes import Record, read_outcomes
from visualhfsm.trials._series import LocalPool, Series

WAITS = document(
    sub(
        1,
        0,
        state(1, "waiting", "rolled.append(random.random())\nsizes |= {str(len(rolled))}", initial=True),
        state(2, "done"),
        transition(1, 1, 2, "sum(rolled) > self.patience", name="enough"),
        variables="rolled = []\nsizes = set()",
    ),
    libraries=("random",),
    head="<parameters><parameter><name>patience</name><type>float</type><default>3</default></parameter></parameters>",
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    folder = tmp_path / "documents"
    folder.mkdir()
    (folder / "waits.xml").write_text(WAITS, encoding="utf-8")
    return folder / "waits.xml"


def plan(path: Path, runs: int = 12, **fields: object) -> Plan:
    return Plan(
        **{
            "document": str(path),
            "robot": "none",
            "limit": 1.0,
            "runs": runs,
            "success": Success(state="done"),
            "parameters": {"patience": Spread(lowest=2.0, highest=6.0)},
            **fields,
        }  # type: ignore[arg-type]
    )


def computed(series: Series, file: Path, pool: LocalPool) -> list[Outcome]:
    with Record(file, series.header) as record:
        series.run(record, pool)
    return sorted(read_outcomes(file), key=lambda outcome: outcome.number)


def test_one_process_and_three_compute_the_same(path: Path, tmp_path: Path) -> None:
    series = Series(plan(path))
    with LocalPool(1) as one, LocalPool(3) as three:
        first = computed(series, tmp_path / "one", one)
        assert computed(series, tmp_path / "three", three) == first
    assert [outcome.number for outcome in first] == [*range(1, 13)]
    assert {outcome.success for outcome in first} == {True, False}


def test_a_series_that_counted_from_0_is_not_gone_on_with(path: Path, tmp_path: Path) -> None:
    header = Series(plan(path)).header
    kept = tmp_path / "kept"
    former = {name: each for name, each in msgspec.to_builtins(header).items() if name != "first"}
    kept.write_bytes(msgspec.json.encode(former) + b"\n")
    with pytest.raises(TrialsError, match="outcomes of another plan, document or version: --again replaces"):
        Record(kept, header)


def test_a_series_goes_on_where_it_was_broken_off(path: Path, tmp_path: Path) -> None:
    series = Series(plan(path))
    computed_again: list[int] = []
    with LocalPool(2) as pool:
        whole = computed(series, tmp_path / "whole", pool)
        with Record(tmp_path / "broken", series.header) as record:
            for outcome in islice(series.outcomes(range(1, 13), pool), 5):
                record.add(outcome)
        with Record(tmp_path / "broken", series.header) as record:
            series.run(record, pool, lambda outcome: computed_again.append(outcome.number))
    assert len(computed_again) == 7
    assert sorted(read_outcomes(tmp_path / "broken"), key=lambda each: each.number) == whole


def test_an_edit_meanwhile_does_not_reach_the_trials(path: Path, tmp_path: Path) -> None:
    series = Series(plan(path, 3))
    path.write_text("no document", encoding="utf-8")
    with LocalPool(1) as pool:
        assert len(computed(series, tmp_path / "out", pool)) == 3


def test_one_process_runs_trials_of_several_series_by_turns(path: Path, tmp_path: Path) -> None:
    first = Series(plan(path, 3))
    path.write_text(WAITS.replace("done", "over"), encoding="utf-8")
    second = Series(plan(path, 3, success=Success(state="over")))
    with LocalPool(1) as pool:
        whole = [computed(each, tmp_path / f"whole{i}", pool) for i, each in enumerate((first, second))]
        alternating = [[*each.outcomes([number], pool)] for number in range(1, 4) for each in (first, second)]
    assert [outcome for (outcome,) in alternating[::2]] == whole[0]
    assert [outcome for (outcome,) in alternating[1::2]] == whole[1]
    assert {outcome.states for outcome in whole[0]} <= {"waiting", "done"}
    assert {outcome.states for outcome in whole[1]} <= {"waiting", "over"}


def test_a_killed_process_costs_its_trial_only_which_is_run_again(path: Path, tmp_path: Path) -> None:
    series = Series(plan(path, 30))
    with LocalPool(2) as pool:
        whole = computed(series, tmp_path / "whole", pool)
        killed = 0
        with Record(tmp_path / "killed", series.header) as record:
            for outcome in series.outcomes(range(1, 31), pool):
                record.add(outcome)
                if outcome.number % 7 == 0:
                    for child in psutil.Process().children():
                        child.kill()
                        killed += 1
    assert killed >= 5
    assert sorted(read_outcomes(tmp_path / "killed"), key=lambda each: each.number) == whole


def test_variables_of_modules_do_not_last_from_trial_to_trial(path: Path) -> None:
    counting = "number = 0\n\n\ndef following(*_):\n    global number\n    number += 1\n    return number\n"
    (path.parent / "counting.py").write_text(counting)
    judge = "def counted(run):\n    return run.variables(1)['counted']\n"
    (path.parent / "judge.py").write_text(f"{counting}\n\n{judge}")
    only = sub(1, 0, state(1, "only", "counted = following()", initial=True), variables="counted = 0")
    path.write_text(document(only, libraries=("from counting import following",)), encoding="utf-8")
    counts = Plan(
        document=str(path), robot="none", runs=3, limit=0.3,
        numbers={"judged": "judge.py:following", "counted": "judge.py:counted"}, success=Success(function="judge.py:following"),
    )  # fmt: skip
    first, *others = run_trials(counts, workers=1).rows
    assert first.numbers["judged"] == 2
    assert [each.numbers for each in others] == [first.numbers, first.numbers]


def hanging(code: str) -> str:
    return document(sub(1, 0, state(1, "only", code, initial=True)), libraries=("time", "os"))


def test_a_trial_that_hangs_fails_with_its_values(path: Path) -> None:
    path.write_text(hanging("while True:\n    pass"), encoding="utf-8")
    hangs = Plan(document=str(path), robot="none", runs=1, patience=5.0, scene={}, parameters={}, limit=1.0)
    summary = run_trials(hangs, workers=1)
    assert [row.reason for row in summary.rows] == ["took more than 5 s"]


def test_a_trial_that_ends_its_process_fails(path: Path) -> None:
    path.write_text(hanging("os._exit(3)"), encoding="utf-8")
    summary = run_trials(Plan(document=str(path), robot="none", runs=1, limit=1.0), workers=1)
    assert [row.reason for row in summary.rows] == ["ended its process"]


def test_a_trial_that_eats_memory_fails_at_its_limit(path: Path) -> None:
    path.write_text(hanging("kept = bytearray(900 << 20)"), encoding="utf-8")
    summary = run_trials(Plan(document=str(path), robot="none", runs=1, limit=1.0, memory=600), workers=1)
    assert "MemoryError" in summary.rows[0].reason or "memory" in summary.rows[0].reason


def test_what_a_trial_prints_goes_nowhere(path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path.write_text(hanging("print('hello')\nos.write(1, b'there')"), encoding="utf-8")
    assert run_trials(Plan(document=str(path), robot="none", runs=2, limit=0.3), workers=1).rate.rate == 1.0
    assert "hello" not in capfd.readouterr().out


def test_a_plan_that_is_not_possible_ends_the_series_at_once(path: Path) -> None:
    with pytest.raises(TrialsError, match="there is no state finished; there are waiting, done"):
        run_trials(plan(path, success=Success(state="finished")), workers=2)
    path.write_text("no document", encoding="utf-8")
    with pytest.raises(TrialsError, match=r"documents/waits\.xml cannot be run"):
        run_trials(plan(path), workers=1)


def test_outcomes_are_kept_where_they_are_wanted(path: Path, tmp_path: Path) -> None:
    out = tmp_path / "kept.jsonl"
    ended: list[Outcome] = []
    first = run_trials(plan(path), out=out, workers=1)
    again = run_trials(plan(path, 15), out=out, workers=1, ended=ended.append)
    assert [outcome.number for outcome in ended] == [13, 14, 15]
    assert again.rows[:12] == first.rows
