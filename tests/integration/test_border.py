"""The core stands without plug-ins: in a tree that has none it runs; `make soak` runs its tests there.

That it imports none is a contract, which `make lint` holds.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from tests.support.environments import make_environment
from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.plugins import OF_THE_WHOLE
from tools import workspace

MADE: Final = {".git", ".venv", "coverage", "demo", "dist", "node_modules", "site"}
"""Folders that the tree does not get, wherever they are."""
PLUG_INS: Final = tuple(path.name for each in workspace.PLUG_INS for path in each.packages)


def left_out(folder: str, names: list[str]) -> set[str]:
    return MADE.intersection(names) | ({"plugins"} if Path(folder) == ROOT else set())


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A checkout without plug-ins, beside the environment in which it is installed."""
    home = tmp_path_factory.mktemp("core")
    tree = Path(shutil.copytree(ROOT, home / "tree", ignore=left_out))
    for modules in (ROOT / "tests").glob("*/node_modules"):
        (tree / modules.relative_to(ROOT)).symlink_to(modules)
    make_environment(home / "environment", ["dev"], packages=tree, editable=True)
    yield tree
    shutil.rmtree(home)


def run(tree: Path, *command: str) -> str:
    """Run a program of the environment in the tree; return what it printed."""
    program = tree.parent / "environment" / "bin" / command[0]
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    done = subprocess.run(
        [program, *command[1:]],
        cwd=tree,
        env=environment,
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@OF_THE_WHOLE
def test_no_plug_in_is_there(tree: Path) -> None:
    code = f"from importlib.util import find_spec; print([n for n in {PLUG_INS} if find_spec(n)])"
    assert len(PLUG_INS) > 7
    assert run(tree, "python", "-c", code) == "[]\n"


def test_commands_offer_nothing_of_them(tree: Path) -> None:
    assert "grade" not in run(tree, "visualhfsm", "--help")
    assert "--qi" not in run(tree, "naoserver-sim", "--help")
    assert "check" in run(tree, "visualhfsm", "--help")


def test_what_codegen_writes_is_the_same(tree: Path) -> None:
    run(tree, "codegen", "--check", *map(str, sorted((tree / "behaviors").glob("*.xml"))))
