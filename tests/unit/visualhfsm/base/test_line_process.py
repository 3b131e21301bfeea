"""A process that answers lines: it ends with its owner, and is restarted for the next question after a failure."""

from __future__ import annotations

import contextlib
import os
import resource
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.limits import START_LIMIT
from tests.support.waiting import until
from visualhfsm._base.line_process import KilledError, LineProcess, NoAnswerError, TooSlowError

pytestmark = pytest.mark.slow

ANSWERS = """
import os, time
from visualhfsm._base.line_process import answer_lines

def late_parts():
    yield b"one"
    time.sleep(3600)

def answer(line):
    match line.strip():
        case b"end":
            os._exit(1)
        case b"wait":
            time.sleep(3600)
        case b"print":
            print("this is no answer")
        case b"flood":
            return b"x" * (5 << 20)
        case b"parts":
            return iter((b"one", b"two"))
        case b"slow parts":
            return late_parts()
    return line.strip()[::-1]

answer_lines(answer)
"""


@pytest.fixture
def process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LineProcess]:
    (tmp_path / "reversing_lines.py").write_text(ANSWERS)
    monkeypatch.syspath_prepend(tmp_path)
    process = LineProcess("reversing_lines", longest_answer=4 << 20)
    yield process
    process.close()


def test_each_question_is_answered_with_a_line(process: LineProcess) -> None:
    assert process.ask(b"abc", START_LIMIT) == b"cba"
    assert process.ask(b"print", START_LIMIT) == b"tnirp"


def test_an_answer_may_have_parts(process: LineProcess) -> None:
    late: list[str] = []
    assert process.ask(b"parts", START_LIMIT) == b"one"
    assert process.more(START_LIMIT, START_LIMIT, lambda: late.append("two")) == b"two"
    assert process.ask(b"slow parts", START_LIMIT) == b"one"
    with pytest.raises(TooSlowError):
        process.more(0.02, 0.01, lambda: late.append("three"))
    assert process.ask(b"abc", START_LIMIT) == b"cba"
    assert late == ["three"]


def test_what_fails_while_a_part_is_late_ends_the_process(process: LineProcess) -> None:
    assert process.ask(b"slow parts", START_LIMIT) == b"one"
    with pytest.raises(IndexError):
        process.more(START_LIMIT, 0.01, [].pop)
    assert process.ask(b"abc", START_LIMIT) == b"cba"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("question", "limit"), [(b"end", START_LIMIT), (b"wait", 0.01), (b"flood", START_LIMIT)]
)
def test_a_process_that_fails_or_hangs_is_replaced(
    process: LineProcess, question: bytes, limit: float
) -> None:
    assert process.ask(b"abc", START_LIMIT) == b"cba"
    with pytest.raises(NoAnswerError):
        process.ask(question, limit)
    assert process.ask(b"abc", START_LIMIT) == b"cba"


def test_a_process_that_does_not_read_is_given_up_at_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "deaf.py").write_text("import time; print(flush=True); time.sleep(3600)")
    monkeypatch.syspath_prepend(tmp_path)
    with contextlib.closing(LineProcess("deaf")) as deaf, pytest.raises(TooSlowError):
        deaf.ask(b"x" * (1 << 20), 0.1)  # a pipe holds 64 kB


@pytest.mark.slow
def test_what_a_process_takes_to_start_does_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "late.py").write_text(f"import time; print('hello'); time.sleep(0.4)\n{ANSWERS}")
    monkeypatch.syspath_prepend(tmp_path)
    with contextlib.closing(LineProcess("late", start_limit=START_LIMIT)) as late:

        def is_answered() -> bool:
            try:
                return late.ask(b"abc", 0.3) == b"cba"
            except TooSlowError:  # on a busy machine the answer, too, may take so long: it starts once more
                return False

        until(is_answered, START_LIMIT)


def test_a_process_that_does_not_start_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "absent.py").write_text("import time; time.sleep(3600)")
    monkeypatch.syspath_prepend(tmp_path)
    with (
        contextlib.closing(LineProcess("absent", start_limit=0.1)) as absent,
        pytest.raises(KilledError, match="not ready"),
    ):
        absent.ask(b"abc", START_LIMIT)


def test_a_process_that_ends_before_it_is_ready_has_answered_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "brief.py").write_text("raise SystemExit(1)")
    monkeypatch.syspath_prepend(tmp_path)
    with (
        contextlib.closing(LineProcess("brief")) as brief,
        pytest.raises(KilledError, match="before it was ready"),
    ):
        brief.ask(b"abc", START_LIMIT)


def test_a_long_question_arrives_whole(process: LineProcess) -> None:
    question = bytes(range(97, 123)) * 100_000
    assert process.ask(question, START_LIMIT) == question[::-1]


def test_nothing_is_answered_after_the_end(process: LineProcess) -> None:
    process.close()
    with pytest.raises(NoAnswerError, match="ended"):
        process.ask(b"abc", START_LIMIT)


def test_a_program_with_many_open_files_gets_answers(process: LineProcess) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(2048, hard), hard))
    try:
        with contextlib.ExitStack() as files:
            for _ in range(1024):  # more than `select` takes
                files.enter_context(Path(os.devnull).open())
            assert process.ask(b"abc", START_LIMIT) == b"cba"
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
