"""Tests of an editor: nothing of them is left when it is killed."""

from __future__ import annotations

import sys
from pathlib import Path

import psutil

from tests.support.killed_editor import COUNTS, HANGS, eventually_below, written
from tests.support.limits import START_LIMIT
from tests.support.processes import ComponentProcess, assert_gone
from tests.support.waiting import until

TESTING_EDITOR = """
import asyncio, sys
from pathlib import Path
from tests.support.killed_editor import opened
from visualhfsm._processes.tests import StartedTests

async def edit():
    path = Path(sys.argv[1])
    await StartedTests(lambda push: print(push.status, flush=True), path.parent).start(opened(path))
    await asyncio.Event().wait()

asyncio.run(edit())
"""


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
