"""The file in which a component keeps what it executes, read as if its process had ended."""

from __future__ import annotations

from pathlib import Path

import pytest

from zenoh_ice.application.last_cycle import VARIABLE, CycleFile, LastCycle, create, read


@pytest.fixture
def path(tmp_path: Path) -> Path:
    create(tmp_path / "last_cycle")
    return tmp_path / "last_cycle"


def test_the_newest_cycle_counts_and_one_that_runs_before_all_others(path: Path) -> None:
    file = CycleFile(path)
    assert read(path) is None
    file.write(1, 4)
    file.write(2, 5, 3)
    assert read(path) == LastCycle(2, 5, 3, running=True)
    file.write(2, 6, running=False)
    assert read(path) == LastCycle(1, 4, 0, running=True)
    file.write(1, 4, running=False)
    assert read(path) == LastCycle(1, 4, 0, running=False)


def test_after_an_orderly_end_there_is_none_even_if_a_cycle_goes_on(path: Path) -> None:
    file = CycleFile(path)
    file.write(1, 4)
    file.close()
    file.write(1, 5)
    assert read(path) is None


def test_automata_beyond_its_room_are_left_out(path: Path) -> None:
    file = CycleFile(path)
    for automaton in range(1, 5001):
        file.write(automaton, 1)
    found = read(path)
    assert found is not None
    assert found.automaton == 4096


def test_the_file_is_named_once(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(path))
    assert CycleFile.of_parent() is not None
    assert CycleFile.of_parent() is None  # not for a process that user code starts
    monkeypatch.setenv(VARIABLE, str(path.with_name("gone")))
    assert CycleFile.of_parent() is None


@pytest.mark.parametrize("content", [b"", b"x", b"\0" * 1000])
def test_what_is_no_such_file_says_nothing(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    assert read(path) is None
    assert read(path.with_name("gone")) is None
