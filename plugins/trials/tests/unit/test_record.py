"""The file of outcomes: whatever ends a series, what is done is kept."""

from __future__ import annotations

import resource
import signal
from pathlib import Path

import pytest

from visualhfsm.trials import Outcome, TrialsError
from visualhfsm_trials._record import Header, Record, read_looks, read_outcomes

HEADER = Header("walk.xml", "abc", {"python": "3.11"})


def outcome(number: int, *, success: bool = True) -> Outcome:
    return Outcome(number=number, values={"x": 0.5, "world": "soccer", "noise": True}, success=success)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "new" / "walk.outcomes.jsonl"


def test_outcomes_are_kept_as_they_come(path: Path) -> None:
    with Record(path, HEADER) as record:
        for number in (3, 1):
            record.add(outcome(number))
            assert [each.number for each in read_outcomes(path)][-1] == number
    with Record(path, HEADER) as record:
        assert record.done == {1, 3}
        record.add(outcome(2, success=False))
    assert [*read_outcomes(path)] == [outcome(3), outcome(1), outcome(2, success=False)]


@pytest.mark.parametrize("cut", [1, 20])
def test_a_line_that_a_crash_cut_off_is_computed_again(path: Path, cut: int) -> None:
    with Record(path, HEADER) as record:
        record.add(outcome(1))
        record.add(outcome(2))
    path.write_bytes(path.read_bytes()[:-cut])
    assert [each.number for each in read_outcomes(path)] == [1]
    with Record(path, HEADER) as record:
        assert record.done == {1}
        record.add(outcome(2))
    assert [*read_outcomes(path)] == [outcome(1), outcome(2)]


def test_a_first_line_that_a_crash_cut_off_is_no_other_series(path: Path) -> None:
    with Record(path, HEADER):
        pass
    path.write_bytes(path.read_bytes()[:-5])
    with Record(path, HEADER) as record:
        record.add(outcome(1))
    assert [*read_outcomes(path)] == [outcome(1)]


def test_outcomes_of_something_else_are_not_mixed_in(path: Path) -> None:
    with Record(path, HEADER) as record:
        record.add(outcome(1))
    other = Header("walk.xml", "abd", HEADER.versions)
    with pytest.raises(TrialsError, match="outcomes of another plan, document or version: --again replaces"):
        Record(path, other)
    assert [*read_outcomes(path)] == [outcome(1)]
    with Record(path, other, again=True) as record:
        assert record.done == set()
    assert [*read_outcomes(path)] == []


def test_a_series_of_which_no_trial_has_ended_gives_way_to_another_one(path: Path) -> None:
    with Record(path, HEADER):
        pass
    other = Header("walk.xml", "abd", HEADER.versions)
    with Record(path, other) as record:
        record.add(outcome(1))
    assert [*read_outcomes(path)] == [outcome(1)]
    with pytest.raises(TrialsError, match="outcomes of another plan"):
        Record(path, HEADER)


def test_it_is_noted_how_many_trials_were_asked_for(path: Path) -> None:
    with Record(path, HEADER) as record:
        record.look(1)
        record.look(2)  # no trial had ended, so that nobody saw anything
        record.add(outcome(1))
        record.look(2)
        record.add(outcome(2))
    assert read_looks(path) == (2,)
    with Record(path, HEADER) as record:
        assert record.done == {1, 2}
        record.look(2)
        record.look(4)
        record.add(outcome(3))
        record.look(2)
    assert read_looks(path) == (2, 4)
    assert [each.number for each in read_outcomes(path)] == [1, 2, 3]
    with Record(path, HEADER, again=True):
        assert read_looks(path) == ()


def test_two_processes_do_not_write_to_one_file(path: Path) -> None:
    with Record(path, HEADER), pytest.raises(TrialsError, match="another process writes outcomes to it now"):
        Record(path, HEADER)
    with Record(path, HEADER):
        pass


def test_what_is_no_file_of_outcomes_is_not_overwritten(path: Path) -> None:
    path.parent.mkdir()
    path.write_text("my notes\n")
    with pytest.raises(TrialsError, match="is no file of outcomes"):
        Record(path, HEADER)
    assert path.read_text() == "my notes\n"


def test_a_file_with_a_broken_line_names_it(path: Path) -> None:
    with Record(path, HEADER) as record:
        record.add(outcome(1))
    with path.open("a") as file:
        file.write("no outcome\n")
    with pytest.raises(TrialsError, match=r":3: no outcome of a trial"):
        [*read_outcomes(path)]


def test_a_full_disk_loses_nothing_that_is_done(path: Path) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # else it ends the process
    try:
        with Record(path, HEADER) as record:
            record.add(outcome(1))
            resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 10, before[1]))
            with pytest.raises(TrialsError, match="outcome 2 cannot be kept: "):
                record.add(outcome(2))
            assert record.done == {1}
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    with Record(path, HEADER) as record:
        assert record.done == {1}


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(TrialsError, match="outcomes cannot be kept there"):
        Record(tmp_path / "file" / "walk.outcomes.jsonl", HEADER)
