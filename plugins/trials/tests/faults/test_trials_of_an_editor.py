"""Trials of an editor: nothing of them is left when it is killed."""

from __future__ import annotations

import sys
from pathlib import Path

import psutil
import pytest

from tests.support.killed_editor import COUNTS, HANGS, eventually_below, written
from tests.support.limits import START_LIMIT
from tests.support.processes import ComponentProcess, assert_gone
from tests.support.waiting import until

WORKER = "visualhfsm.trials._worker"
SERIES = "visualhfsm_trials._series_process"
EDITOR = """
import asyncio, sys
from pathlib import Path
from tests.support.killed_editor import opened
from visualhfsm_trials._messages import Choices
from visualhfsm_trials._service import RunningTrials

async def edit():
    trials = RunningTrials(lambda push: print(push.status, flush=True))
    await trials.run(opened(Path(sys.argv[1])), Choices(runs=1000, robot="none", limit=1.0))
    await asyncio.Event().wait()

asyncio.run(edit())
"""


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
