"""docs/how-to/steering.md: files are written, commands run, outputs compared."""

from __future__ import annotations

import ast
import shlex
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from interfaces.hfsm import HfsmMonitorPrx
from tests.integration.test_docs_interfaces import ENDPOINT, commands, matches
from tests.support.codegen_command import ROOT, codegen
from tests.support.commands import run_here
from tests.support.limits import EVENT_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.processes import ComponentProcess, free_endpoint
from visualhfsm.command import app
from visualhfsm.errors import VisualHfsmError
from zenoh_ice import initialize

pytestmark = pytest.mark.slow


def run(command: str, folder: Path) -> str:
    """Return what a command of the page writes: ours run here, since processes take long to start."""
    program, *arguments = shlex.split(command)
    if program == "visualhfsm":
        done = run_here(app, program, *arguments, cwd=folder, expected=(VisualHfsmError,))
    elif program == "codegen":
        done = codegen(*arguments, cwd=folder)
    else:
        done = subprocess.run(
            command, shell=True, cwd=folder, capture_output=True, text=True, timeout=RUN_LIMIT, check=False
        )
    return done.stdout + done.stderr


def test_the_page_works_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    endpoint = free_endpoint()
    monkeypatch.setenv("VISUALHFSM_CONNECT", endpoint)
    own = {"PYTHONPATH": str(ROOT), "VISUALHFSM_CONNECT": endpoint}
    ran = 0
    with ExitStack() as stack:
        for block in blocks_of((DOCS / "how-to/steering.md").read_text(encoding="utf-8")):
            if block.name is not None:
                (tmp_path / block.name).write_text(block.text, encoding="utf-8")
                continue
            if block.language == "python":
                ast.parse(block.text)
                continue
            assert block.language == "console"
            for command, expected in commands(block.text.replace(ENDPOINT, endpoint)):
                ran += 1
                if command.endswith(" &"):
                    program, script, *options, _ = command.split()
                    assert program == "python"
                    component = ComponentProcess([sys.executable, str(tmp_path / script), *options], own)
                    stack.enter_context(component)
                    with initialize(connect=[endpoint], clock="wall") as communicator:
                        proxy = communicator.stringToProxy("Hfsm.patrol")
                        HfsmMonitorPrx.uncheckedCast(proxy).getSnapshot.wait(timeout=START_LIMIT)
                    continue
                output = run(command, tmp_path)
                deadline = time.monotonic() + EVENT_LIMIT
                # A reader types more slowly: the component does a cycle, and its time goes on, in between.
                while "why" in command and not matches(expected, output) and time.monotonic() < deadline:
                    output = run(command, tmp_path)
                assert matches(expected, output), f"{command}\n{output}"
        assert ran == 25
        assert component.wait() == 0, component.output
