"""docs/how-to/learning.md: its programs print the documented output, and it lists every environment."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from naoserver_sim.learning import ENVIRONMENTS
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.processes import REPOSITORY

pytestmark = pytest.mark.sim

PAGE = (DOCS / "how-to/learning.md").read_text("utf-8")
BLOCKS = blocks_of(PAGE)


def run(*arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    ("code", "output"), list(zip(BLOCKS[::2], BLOCKS[1::2], strict=True)), ids=["robot", "learning"]
)
def test_a_program_prints_what_the_page_says(code, output):
    assert (code.language, output.language) == ("python", "text")
    assert run("-c", code.text) == output.text


def test_every_environment_has_its_row():
    for name, steps in ENVIRONMENTS.items():
        (row,) = [
            line for line in PAGE.splitlines() if line.startswith(f"| `{name}` | ") and " steps |" in line
        ]
        assert f"| {steps} steps |" in row


def test_the_walk_of_the_example_ends_near_where_it_began():
    *_, last = run("examples/one_process.py").splitlines()
    assert last.startswith("side 4: believes to be at (")


def test_the_example_learns():
    before, after = (float(line.split()[-3]) for line in run("examples/learn_to_reach.py", "1").splitlines())
    assert -1.0 < before < 1.0
    assert -1.0 < after < 1.0
