"""docs/how-to/interfaces.md and docs/how-to/serving.md: files are written, commands run, outputs compared."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support.codegen_command import ROOT, codegen
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.processes import ComponentProcess, free_endpoint

ENDPOINT = "tcp/127.0.0.1:7447"


def commands(text: str) -> list[tuple[str, str]]:
    """Return the commands of a console, each with what it writes."""
    parts = re.split(r"^\$ ", text, flags=re.M)[1:]
    return [(part.partition("\n")[0], part.partition("\n")[2]) for part in parts]


def matches(expected: str, output: str) -> bool:
    """Return whether an output is as expected; three dots match anything."""
    pattern = ".*".join(map(re.escape, expected.split("...")))
    return re.fullmatch(pattern, output, re.S) is not None


@pytest.mark.parametrize(("page", "count"), [("how-to/interfaces.md", 9), ("how-to/serving.md", 3)])
def test_the_page_works_as_it_stands(tmp_path: Path, page: str, count: int) -> None:
    endpoint = free_endpoint()
    own = {"PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "VISUALHFSM_CONNECT": endpoint}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ran = 0
    with ExitStack() as stack:
        for block in blocks_of((DOCS / page).read_text("utf-8")):
            if block.name is not None:
                (tmp_path / block.name).write_text(block.text.replace(ENDPOINT, endpoint), "utf-8")
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
                if command.startswith("codegen "):  # here, since processes take long to start
                    here = codegen(*command.split()[1:], cwd=tmp_path)
                    assert matches(expected, here.stdout + here.stderr), f"{command}\n{here}"
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
    assert ran == count
    assert (server.process.returncode, "Traceback" in server.output) == (0, False)
