"""Series of trials whose outcomes are kept in a file, with which they go on."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import msgspec
import pytest

from tests.support.documents import document, state, sub, transition
from visualhfsm.trials import LocalPool, Outcome, Plan, Spread, Success, TrialsError
from visualhfsm_trials import run_trials
from visualhfsm_trials._record import Record, read_outcomes
from visualhfsm_trials._series import KeptSeries

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
        assert len([*KeptSeries(plan(path, 1)).outcomes([1], pool)]) == 1  # its thread begins here
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


def computed(series: KeptSeries, file: Path, pool: LocalPool) -> list[Outcome]:
    with Record(file, series.header) as record:
        series.run(record, pool)
    return sorted(read_outcomes(file), key=lambda outcome: outcome.number)


def test_a_series_that_counted_from_0_is_not_gone_on_with(path: Path, tmp_path: Path) -> None:
    header = KeptSeries(plan(path)).header
    kept = tmp_path / "kept"
    former = {name: each for name, each in msgspec.to_builtins(header).items() if name != "first"}
    ended = Outcome(number=0, values={}, success=True)
    kept.write_bytes(msgspec.json.encode(former) + b"\n" + msgspec.json.encode(ended) + b"\n")
    with pytest.raises(TrialsError, match="outcomes of another plan, document or version: --again replaces"):
        Record(kept, header)


def test_a_series_goes_on_where_it_was_broken_off(path: Path, tmp_path: Path, pool: LocalPool) -> None:
    series = KeptSeries(plan(path))
    computed_again: list[int] = []
    whole = computed(series, tmp_path / "whole", pool)
    with Record(tmp_path / "broken", series.header) as record:
        for outcome in islice(series.outcomes(range(1, 13), pool), 5):
            record.add(outcome)
    with Record(tmp_path / "broken", series.header) as record:
        series.run(record, pool, lambda outcome: computed_again.append(outcome.number))
    assert len(computed_again) == 7
    assert sorted(read_outcomes(tmp_path / "broken"), key=lambda each: each.number) == whole


def test_outcomes_are_kept_where_they_are_wanted(path: Path, tmp_path: Path) -> None:
    out = tmp_path / "kept.jsonl"
    ended: list[Outcome] = []
    first = run_trials(plan(path), out=out, workers=1)
    again = run_trials(plan(path, 15), out=out, workers=1, ended=ended.append)
    assert sorted(outcome.number for outcome in ended) == [13, 14, 15]
    assert again.rows[:12] == first.rows
