"""Series of trials in processes: the same outcomes on any number of them, and whatever happens to them."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec
import pytest

from tests.support.documents import document, state, sub, transition
from tests.support.limits import FOREVER
from tests.support.processes import children
from tests.support.soak import cases, repeated
from tests.support.waiting import until
from visualhfsm.trials import Outcome, Plan, Spread, Success, TrialsError
from visualhfsm.trials._quantities import Quantity
from visualhfsm.trials._series import LocalPool, Series

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


def computed(series: Series, pool: LocalPool) -> list[Outcome]:
    return sorted(series.outcomes(series.plan.trials, pool), key=lambda outcome: outcome.number)


def run(plan: Plan, pool: LocalPool) -> list[Outcome]:
    """Run all trials of a plan."""
    return computed(Series(plan), pool)


def test_one_process_and_three_compute_the_same(path: Path, pool: LocalPool) -> None:
    series = Series(plan(path))
    first = computed(series, pool)
    with LocalPool(repeated(test=2, soak=3)) as several:
        assert computed(series, several) == first
    assert [outcome.number for outcome in first] == [*range(1, 13)]
    assert {outcome.success for outcome in first} == {True, False}


def test_an_edit_meanwhile_does_not_reach_the_trials(path: Path, pool: LocalPool) -> None:
    series = Series(plan(path, 3))
    path.write_text("no document", encoding="utf-8")
    assert len(computed(series, pool)) == 3


def test_one_process_runs_trials_of_several_series_by_turns(path: Path, pool: LocalPool) -> None:
    first = Series(plan(path, 3))
    path.write_text(WAITS.replace("done", "over"), encoding="utf-8")
    second = Series(plan(path, 3, success=Success(state="over")))
    whole = [computed(each, pool) for each in (first, second)]
    alternating = [[*each.outcomes([number], pool)] for number in range(1, 4) for each in (first, second)]
    assert [outcome for (outcome,) in alternating[::2]] == whole[0]
    assert [outcome for (outcome,) in alternating[1::2]] == whole[1]
    assert {outcome.states for outcome in whole[0]} <= {"waiting", "done"}
    assert {outcome.states for outcome in whole[1]} <= {"waiting", "over"}


def test_a_killed_process_costs_its_trial_only_which_is_run_again(path: Path, pool: LocalPool) -> None:
    series = Series(plan(path, repeated(test=8, soak=30)))
    whole = computed(series, pool)
    killed = 0
    outcomes: list[Outcome] = []
    for outcome in series.outcomes(series.plan.trials, pool):
        outcomes.append(outcome)
        if outcome.number % 7 == repeated(test=3, soak=0):
            for child in children(WORKER):
                child.kill()
                killed += 1
    assert killed == repeated(test=1, soak=4)
    assert sorted(outcomes, key=lambda each: each.number) == whole


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
    first, *others = run(counts, pool)
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
        outcomes = aside.submit(run, hangs, pool)
        for _ in range(kills):
            until(lambda: outcomes.done() or begun.exists(), FOREVER)
            begun.unlink()
            for child in children(WORKER):
                child.kill()
        rows = outcomes.result(FOREVER)
    assert [row.reason for row in rows] == ["took more than 0.3 s"]


def test_a_trial_that_ends_its_process_fails(path: Path, pool: LocalPool) -> None:
    path.write_text(hanging("os._exit(3)"), encoding="utf-8")
    rows = run(Plan(document=str(path), robot="none", runs=1, limit=1.0), pool)
    assert [row.reason for row in rows] == ["ended its process"]


def test_a_trial_that_eats_memory_fails_at_its_limit(path: Path, pool: LocalPool) -> None:
    path.write_text(hanging("kept = bytearray(900 << 20)"), encoding="utf-8")
    rows = run(Plan(document=str(path), robot="none", runs=1, limit=1.0, memory=600), pool)
    assert "MemoryError" in rows[0].reason or "memory" in rows[0].reason


def test_what_a_trial_prints_goes_nowhere(
    path: Path, capfd: pytest.CaptureFixture[str], pool: LocalPool
) -> None:
    path.write_text(hanging("print('hello')\nos.write(1, b'there')"), encoding="utf-8")
    assert all(each.success for each in run(Plan(document=str(path), robot="none", runs=2, limit=0.3), pool))
    assert "hello" not in capfd.readouterr().out


def test_a_plan_that_is_not_possible_ends_the_series_at_once(path: Path, pool: LocalPool) -> None:
    with pytest.raises(TrialsError, match="there is no state finished; there are waiting, done"):
        run(plan(path, success=Success(state="finished")), pool)
    path.write_text("no document", encoding="utf-8")
    with pytest.raises(TrialsError, match=r"documents/waits\.xml cannot be run"):
        run(plan(path), pool)


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
