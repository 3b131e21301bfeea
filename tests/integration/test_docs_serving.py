"""docs/serving.md, followed to the letter: files are written, commands run, outputs compared."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

from tests.integration.test_docs_interfaces import ENDPOINT, commands, matches
from tests.support.codegen_command import ROOT
from tests.support.pages import DOCS, blocks_of
from tests.support.processes import ComponentProcess, free_endpoint


def test_the_page_works_as_it_stands(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    own = {"PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "VISUALHFSM_CONNECT": endpoint}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ran = 0
    with ExitStack() as stack:
        for block in blocks_of((DOCS / "serving.md").read_text(encoding="utf-8")):
            if block.name is not None:
                (tmp_path / block.name).write_text(block.text.replace(ENDPOINT, endpoint), encoding="utf-8")
                continue
            assert block.language == "console"
            for command, expected in commands(block.text):
                ran += 1
                if command.endswith(" &"):
                    program, script, _ = command.split()
                    assert program == "python"
                    server = ComponentProcess([sys.executable, str(tmp_path / script)], own)
                    stack.enter_context(server).wait_for(expected.strip())
                    continue
                done = subprocess.run(
                    command,
                    shell=True,
                    cwd=tmp_path,
                    env={**os.environ, **own, "PATH": path},
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    text=True,
                    timeout=60,
                    check=False,
                )
                assert matches(expected, done.stdout), f"{command}\n{done.stdout}"
    assert ran == 3
    assert (server.process.returncode, "Traceback" in server.output) == (0, False)
