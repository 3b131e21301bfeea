"""docs/how-to/steering.md: files are written, commands run, outputs compared."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from interfaces.hfsm import HfsmMonitorPrx
from tests.integration.test_docs_interfaces import ENDPOINT, commands, matches
from tests.support.codegen_command import ROOT
from tests.support.limits import RUN_LIMIT, START_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.processes import ComponentProcess, free_endpoint
from zenoh_ice import initialize

pytestmark = pytest.mark.slow


def test_the_page_works_as_it_stands(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    own = {"PYTHONPATH": str(ROOT), "VISUALHFSM_CONNECT": endpoint}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
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
                    communicator = stack.enter_context(initialize(connect=[endpoint], clock="wall"))
                    proxy = communicator.stringToProxy("Hfsm.patrol")
                    HfsmMonitorPrx.uncheckedCast(proxy).getSnapshot.wait(timeout=START_LIMIT)
                    continue
                done = subprocess.run(
                    command,
                    shell=True,
                    cwd=tmp_path,
                    env={**os.environ, **own, "PATH": path},
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    text=True,
                    timeout=RUN_LIMIT,
                    check=False,
                )
                assert matches(expected, done.stdout), f"{command}\n{done.stdout}"
        assert ran == 25
        assert component.wait() == 0, component.output
