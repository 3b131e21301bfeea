"""Pieces of code that take turns on one thread, and wait for answers."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest

from hfsm_runtime._replay.script import ReplayEndedError, TimedMessage, Want
from hfsm_runtime.coroutine import Coroutine, current_coroutine
from hfsm_runtime.recording_file.messages import Reading

NOW = Want("now")


def reading(value: object) -> TimedMessage:
    return TimedMessage(0, "/readings", Reading("automaton 1", "now", value), b"")


def ask() -> object:
    """Wait, as code of a replay does, for a reading."""
    code = current_coroutine()
    assert code is not None
    record = code.wait(NOW)
    if record is None:
        return None
    assert isinstance(record.message, Reading)
    return record.message.value


def test_code_runs_until_it_waits_and_others_run_meanwhile() -> None:
    done: list[object] = []

    def work(name: str) -> None:
        done.append(f"{name} begins")
        done.append((name, ask()))
        done.append((name, ask()))

    first, second = Coroutine("automaton 1", lambda: work("1")), Coroutine("automaton 2", lambda: work("2"))
    first.go()
    second.go()
    assert (first.want, second.want, first.ended) == (NOW, NOW, False)
    first.go(reading(5))
    second.go(None)
    first.go(reading(6))
    assert (first.want, first.ended, second.ended) == (None, True, False)
    second.go(reading(7))
    assert done == ["1 begins", "2 begins", ("1", 5), ("2", None), ("1", 6), ("2", 7)]


def test_who_drives_code_gets_its_exception() -> None:
    def fail() -> None:
        ask()
        raise ValueError("no")

    code = Coroutine("automaton 1", fail)
    code.go()
    with pytest.raises(ValueError, match="no"):
        code.go()
    assert code.ended


def test_outside_of_code_there_is_none() -> None:
    found: list[Coroutine | None] = []

    def look() -> None:
        found.append(current_coroutine())
        thread = threading.Thread(target=lambda: found.append(current_coroutine()))
        thread.start()
        thread.join()

    code = Coroutine("automaton 1", look)
    code.go()
    assert found == [code, None]
    assert current_coroutine() is None


def clean_up(done: list[str]) -> None:
    try:
        ask()
    finally:
        done.append("clean")


def clean_up_and_ask(done: list[str]) -> None:
    try:
        ask()
    finally:
        ask()


def fail_at_the_end(done: list[str]) -> None:
    try:
        ask()
    except ReplayEndedError:
        done.append("clean")
        raise ValueError("at the end") from None


def refuse(done: list[str]) -> None:
    while True:
        try:
            ask()
        except BaseException:  # noqa: BLE001 - code that nothing ends
            done.append("clean")


@pytest.mark.parametrize(
    ("work", "cleaned"), [(clean_up, 1), (clean_up_and_ask, 0), (fail_at_the_end, 1), (refuse, 3)]
)
def test_code_that_waits_can_be_ended_whatever_it_does(
    work: Callable[[list[str]], None], cleaned: int
) -> None:
    done: list[str] = []
    code = Coroutine("automaton 1", lambda: work(done))
    code.go()
    code.close(ReplayEndedError)
    assert len(done) == cleaned
    assert code.ended == (work is not refuse)


def test_code_that_has_ended_or_never_began_needs_no_end() -> None:
    Coroutine("automaton 1", lambda: pytest.fail("it ran")).close(ReplayEndedError)
    code = Coroutine("automaton 1", lambda: None)
    code.go()
    code.close(ReplayEndedError)
    assert code.ended
