"""Series of trials in processes: the same outcomes on any number of them, and whatever happens to them."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path

import msgspec
import pytest

from tests.support.documents import document, state, sub, transition
from tests.support.limits import FOREVER
from tests.support.processes import children
from tests.support.soak import cases, repeated
from tests.support.waiting import until
from visualhfsm.trials import Outcome, Plan, Spread, Success, TrialsError, run_trials
from visualhfsm.trials._outcomes import Record, read_outcomes
from visualhfsm.trials._quantities import Quantity
from visualhfsm.trials._series import LocalPool, Series
from visualhfsm.trials._summary import Summary, summarize

pytestmark = pytest.mark.slow

WORKER = "visualhfsm.trials._worker"
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


@pytest.fixture(scope="module")
def pool(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalPool]:
    """One process, which all tests of this file share, and which some of them end."""
    path = tmp_path_factory.mktemp("first") / "waits.xml"
    path.write_text(WAITS, encoding="utf-8")
    with LocalPool(1) as pool:
        assert len([*Series(plan(path, 1)).outcomes([1], pool)]) == 1  # its thread begins here
        yield pool


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


def run(plan: Plan, pool: LocalPool) -> Summary:
    """Run all trials of a plan."""
    file, series = Path(plan.document).parents[1] / "outcomes.jsonl", Series(plan)
    with Record(file, series.header, again=True) as record:
        series.run(record, pool)
    return summarize(file, plan.varying, plan.runs)


def test_one_process_and_three_compute_the_same(path: Path, tmp_path: Path, pool: LocalPool) -> None:
    series = Series(plan(path))
    first = computed(series, tmp_path / "one", pool)
    with LocalPool(repeated(test=2, soak=3)) as several:
        assert computed(series, tmp_path / "several", several) == first
    assert [outcome.number for outcome in first] == [*range(1, 13)]
    assert {outcome.success for outcome in first} == {True, False}


def test_a_series_that_counted_from_0_is_not_gone_on_with(path: Path, tmp_path: Path) -> None:
    header = Series(plan(path)).header
    kept = tmp_path / "kept"
    former = {name: each for name, each in msgspec.to_builtins(header).items() if name != "first"}
    ended = Outcome(number=0, values={}, success=True)
    kept.write_bytes(msgspec.json.encode(former) + b"\n" + msgspec.json.encode(ended) + b"\n")
    with pytest.raises(TrialsError, match="outcomes of another plan, document or version: --again replaces"):
        Record(kept, header)


def test_a_series_goes_on_where_it_was_broken_off(path: Path, tmp_path: Path, pool: LocalPool) -> None:
    series = Series(plan(path))
    computed_again: list[int] = []
    whole = computed(series, tmp_path / "whole", pool)
    with Record(tmp_path / "broken", series.header) as record:
        for outcome in islice(series.outcomes(range(1, 13), pool), 5):
            record.add(outcome)
    with Record(tmp_path / "broken", series.header) as record:
        series.run(record, pool, lambda outcome: computed_again.append(outcome.number))
    assert len(computed_again) == 7
    assert sorted(read_outcomes(tmp_path / "broken"), key=lambda each: each.number) == whole


def test_an_edit_meanwhile_does_not_reach_the_trials(path: Path, tmp_path: Path, pool: LocalPool) -> None:
    series = Series(plan(path, 3))
    path.write_text("no document", encoding="utf-8")
    assert len(computed(series, tmp_path / "out", pool)) == 3


def test_one_process_runs_trials_of_several_series_by_turns(
    path: Path, tmp_path: Path, pool: LocalPool
) -> None:
    first = Series(plan(path, 3))
    path.write_text(WAITS.replace("done", "over"), encoding="utf-8")
    second = Series(plan(path, 3, success=Success(state="over")))
    whole = [computed(each, tmp_path / f"whole{i}", pool) for i, each in enumerate((first, second))]
    alternating = [[*each.outcomes([number], pool)] for number in range(1, 4) for each in (first, second)]
    assert [outcome for (outcome,) in alternating[::2]] == whole[0]
    assert [outcome for (outcome,) in alternating[1::2]] == whole[1]
    assert {outcome.states for outcome in whole[0]} <= {"waiting", "done"}
    assert {outcome.states for outcome in whole[1]} <= {"waiting", "over"}


def test_a_killed_process_costs_its_trial_only_which_is_run_again(
    path: Path, tmp_path: Path, pool: LocalPool
) -> None:
    series = Series(plan(path, repeated(test=8, soak=30)))
    whole = computed(series, tmp_path / "whole", pool)
    killed = 0
    with Record(tmp_path / "killed", series.header) as record:
        for outcome in series.outcomes(series.plan.trials, pool):
            record.add(outcome)
            if outcome.number % 7 == repeated(test=3, soak=0):
                for child in children(WORKER):
                    child.kill()
                    killed += 1
    assert killed == repeated(test=1, soak=4)
    assert sorted(read_outcomes(tmp_path / "killed"), key=lambda each: each.number) == whole


def test_variables_of_modules_do_not_last_from_trial_to_trial(path: Path, pool: LocalPool) -> None:
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
    first, *others = run(counts, pool).rows
    assert first.numbers["judged"] == 2
    assert [each.numbers for each in others] == [first.numbers, first.numbers]


def hanging(code: str, library: str = "os") -> str:
    return document(sub(1, 0, state(1, "only", code, initial=True)), libraries=(library,))


@pytest.mark.parametrize("kills", cases([1], soak=[0, 3]))
def test_a_trial_that_hangs_fails_with_its_values_however_often_it_is_killed(
    path: Path, tmp_path: Path, pool: LocalPool, kills: int
) -> None:
    begun = tmp_path / "begun"
    code = f"open({str(begun)!r}, 'w').close()\nthreading.Event().wait()"
    path.write_text(hanging(code, "threading"), encoding="utf-8")
    hangs = Plan(document=str(path), robot="none", runs=1, patience=0.3, scene={}, parameters={}, limit=1.0)
    with ThreadPoolExecutor(1) as aside:
        summary = aside.submit(run, hangs, pool)
        for _ in range(kills):
            until(lambda: summary.done() or begun.exists(), FOREVER)
            begun.unlink()
            for child in children(WORKER):
                child.kill()
        rows = summary.result(FOREVER).rows
    assert [row.reason for row in rows] == ["took more than 0.3 s"]


def test_a_trial_that_ends_its_process_fails(path: Path, pool: LocalPool) -> None:
    path.write_text(hanging("os._exit(3)"), encoding="utf-8")
    summary = run(Plan(document=str(path), robot="none", runs=1, limit=1.0), pool)
    assert [row.reason for row in summary.rows] == ["ended its process"]


def test_a_trial_that_eats_memory_fails_at_its_limit(path: Path, pool: LocalPool) -> None:
    path.write_text(hanging("kept = bytearray(900 << 20)"), encoding="utf-8")
    summary = run(Plan(document=str(path), robot="none", runs=1, limit=1.0, memory=600), pool)
    assert "MemoryError" in summary.rows[0].reason or "memory" in summary.rows[0].reason


def test_what_a_trial_prints_goes_nowhere(
    path: Path, capfd: pytest.CaptureFixture[str], pool: LocalPool
) -> None:
    path.write_text(hanging("print('hello')\nos.write(1, b'there')"), encoding="utf-8")
    assert run(Plan(document=str(path), robot="none", runs=2, limit=0.3), pool).rate.rate == 1.0
    assert "hello" not in capfd.readouterr().out


def test_a_plan_that_is_not_possible_ends_the_series_at_once(path: Path, pool: LocalPool) -> None:
    with pytest.raises(TrialsError, match="there is no state finished; there are waiting, done"):
        run(plan(path, success=Success(state="finished")), pool)
    path.write_text("no document", encoding="utf-8")
    with pytest.raises(TrialsError, match=r"documents/waits\.xml cannot be run"):
        run(plan(path), pool)


def test_outcomes_are_kept_where_they_are_wanted(path: Path, tmp_path: Path) -> None:
    out = tmp_path / "kept.jsonl"
    ended: list[Outcome] = []
    first = run_trials(plan(path), out=out, workers=1)
    again = run_trials(plan(path, 15), out=out, workers=1, ended=ended.append)
    assert sorted(outcome.number for outcome in ended) == [13, 14, 15]
    assert again.rows[:12] == first.rows


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        ({"posture": ("Stand", "Std")}, r"posture = 'Std': the body H25 has Stand"),
        ({"posture": "Std"}, r"posture = 'Std': the body H25 has Stand"),
        ({"body": ("H25", "T1"), "posture": "SitRelax"}, r"posture = 'SitRelax': the body T1 has "),
        ({"world": ("soccer", "socer")}, r"the scene is not possible: socer: .*soccer"),
        ({"world": ("room", "here.toml")}, r"the scene is not possible: .*/here\.toml: cannot be read"),
        ({"world": ("soccer", "balls"), "Ball.x": 1.0}, r"Ball: there is no such thing in the world"),
        ({"noise": (True, 3)}, r"noise = 3: write true or false"),
    ],
)
def test_what_no_trial_can_have_is_found_before_the_first_one(
    path: Path, scene: dict[str, Quantity], message: str
) -> None:
    with pytest.raises(TrialsError, match=message):
        Series(msgspec.structs.replace(plan(path), robot="sim", scene=scene))


@pytest.mark.parametrize("body", [("H25", "Nao"), "Nao"])
def test_a_robot_that_there_is_not_is_found_before_the_first_trial(path: Path, body: Quantity) -> None:
    of_bodies = msgspec.structs.replace(plan(path), scene={"body": body})
    with pytest.raises(TrialsError, match=r"body = 'Nao': .*H25"):
        Series(of_bodies)
