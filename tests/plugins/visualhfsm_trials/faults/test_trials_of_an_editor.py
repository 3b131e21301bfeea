"""Trials and tests of an editor: nothing of them is left when it is killed; a killed worker costs nothing."""

from __future__ import annotations

import sys
from pathlib import Path

import psutil
import pytest

from codegen.messages import Message
from tests.support.documents import document, state, sub
from tests.support.limits import START_LIMIT
from tests.support.processes import ComponentProcess, assert_gone, children
from tests.support.waiting import until
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.messages import Source

WORKER = "visualhfsm.trials._worker"
SERIES = "visualhfsm_trials._series_process"
EDITOR = """
import asyncio, sys
from pathlib import Path
from tests.faults.test_trials_of_an_editor import opened
from visualhfsm_trials._messages import Choices
from visualhfsm_trials._service import RunningTrials

async def edit():
    trials = RunningTrials(lambda push: print(push.status, flush=True))
    await trials.run(opened(Path(sys.argv[1])), Choices(runs=1000, robot="none", limit=1.0))
    await asyncio.Event().wait()

asyncio.run(edit())
"""
TESTING_EDITOR = """
import asyncio, sys
from pathlib import Path
from tests.faults.test_trials_of_an_editor import opened
from visualhfsm._processes.tests import StartedTests

async def edit():
    path = Path(sys.argv[1])
    await StartedTests(lambda push: print(push.status, flush=True), path.parent).start(opened(path))
    await asyncio.Event().wait()

asyncio.run(edit())
"""
HANGS = "import threading\nopen('begun', 'w').close()\nthreading.Event().wait()"
COUNTS = "self.count = 1"


def opened(path: Path) -> Source:
    """Return an open document."""
    return Source(1, 0, parse(path.read_text(), Message("Cannot read")), path, False, path.stem)


def written(folder: Path, code: str) -> Path:
    path = folder / "documents" / "behavior.xml"
    path.parent.mkdir()
    path.write_text(document(sub(1, 0, state(1, "only", code, initial=True), variables="self.count = 0")))
    return path


def eventually_below(process: psutil.Process, module: str) -> list[psutil.Process]:
    """Wait until a process has started some of a module, directly or not."""
    found: list[psutil.Process] = []

    def are_there() -> bool:
        found[:] = [each for each in children(module) if process in each.parents()]
        return bool(found)

    until(are_there, START_LIMIT)
    return found


@pytest.mark.parametrize("code", [COUNTS, HANGS], ids=["running", "hanging"])
def test_a_killed_editor_leaves_no_process(tmp_path: Path, code: str) -> None:
    path = written(tmp_path, code.replace("'begun'", repr(str(tmp_path / "begun"))))
    with ComponentProcess([sys.executable, "-c", EDITOR, str(path)]) as editor:
        editor.wait_for("running")
        process = psutil.Process(editor.process.pid)
        below = [*eventually_below(process, SERIES), *eventually_below(process, WORKER)]
        until(lambda: code != HANGS or (tmp_path / "begun").exists(), START_LIMIT)
        editor.process.kill()
        assert_gone(below)


def test_a_killed_editor_leaves_no_tests(tmp_path: Path) -> None:
    path = written(tmp_path, COUNTS)
    hangs = HANGS.replace("'begun'", repr(str(path.with_name("begun"))))
    path.with_name("test_it.py").write_text(f"# {path.name}\n{hangs}\ndef test_it(): pass\n")
    with ComponentProcess([sys.executable, "-c", TESTING_EDITOR, str(path)]) as editor:
        editor.wait_for("running")
        below = eventually_below(psutil.Process(editor.process.pid), "pytest")
        until(path.with_name("begun").exists, START_LIMIT)
        editor.process.kill()
        assert_gone(below)
