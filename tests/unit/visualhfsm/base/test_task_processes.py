"""Processes for tasks: one for each thread, whose files go with them, also when they were killed."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import msgspec
import pytest

from tests.support.limits import START_LIMIT
from visualhfsm._base.line_process import KilledError, NoAnswerError
from visualhfsm._base.task_processes import EndedError, TaskProcesses

ANSWERS = """
import base64, json, os, pickle, signal, tempfile
from visualhfsm._base.line_process import answer_lines

def answer(line):
    task = pickle.loads(base64.b64decode(line))
    tempfile.mkstemp()
    if task == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    return json.dumps({"process": os.getpid() if task == "work" else task}).encode()

answer_lines(answer)
"""


class Answer(msgspec.Struct):
    process: int


@pytest.fixture
def processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[TaskProcesses[Answer]]:
    (tmp_path / "working.py").write_text(ANSWERS)
    (tmp_path / "files").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "files"))
    with contextlib.closing(TaskProcesses("working", Answer, "working-")) as made:
        yield made


@pytest.mark.slow
def test_a_thread_has_its_own_process_from_task_to_task(processes: TaskProcesses[Answer]) -> None:
    together = Barrier(2)

    def work() -> set[int]:
        together.wait(START_LIMIT)
        return {processes.ask("work", START_LIMIT).process for _ in range(2)}

    with ThreadPoolExecutor(2) as pool:
        first, second = (each.result() for each in [pool.submit(work), pool.submit(work)])
    assert (len(first), len(second), first & second) == (1, 1, set())


@pytest.mark.slow
def test_what_a_killed_one_has_written_goes_with_all_others(
    processes: TaskProcesses[Answer], tmp_path: Path
) -> None:
    with pytest.raises(KilledError):
        processes.ask("die", START_LIMIT)
    with pytest.raises(NoAnswerError, match="wrote something else"):
        processes.ask("no number", START_LIMIT)
    (left,) = (tmp_path / "files").iterdir()
    assert left.name.startswith("working-")
    processes.close()
    assert [*(tmp_path / "files").iterdir()] == []
    with pytest.raises(EndedError):
        processes.ask("work", START_LIMIT)
