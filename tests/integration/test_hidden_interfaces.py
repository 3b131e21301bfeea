"""A module of a user that hides the package `interfaces`: one error, wherever it is met."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.soak import cases
from zenoh_ice.application import hidden_interfaces

DOCUMENT = ROOT / "behaviors" / "dance.xml"

pytestmark = pytest.mark.slow


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with a document, its component, and the user's module, which fails where it is executed."""
    for file in (DOCUMENT, DOCUMENT.with_suffix(".py")):
        shutil.copy(file, tmp_path)
    (tmp_path / "interfaces.py").write_text("raise RuntimeError('it was executed')\n")
    return tmp_path


def run(
    project: Path, *arguments: str, environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=project,
        env={**os.environ, **(environment or {})},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )


@pytest.mark.parametrize(
    ("arguments", "where"),
    cases(
        [
            (("dance.py", "--help"), "dance.py: error: "),
            (("-c", "from dance import Dance"), "ImportError: "),
            (("-m", "visualhfsm", "check", "dance.xml"), "visualhfsm: error: "),
            (("-m", "codegen", "dance.xml"), "dance.xml: error[E543]: "),
        ],
        [
            pytest.param(("-m", "naoserver_sim"), "naoserver_sim: error: "),
            pytest.param(("-P", "-m", "codegen", "dance.xml"), "dance.xml: error[E543]: "),
            pytest.param(("-P", "-m", "visualhfsm", "check", "dance.xml"), "dance.xml: error[E543]: "),
        ],
    ),
)
def test_it_is_named_with_the_remedy(project: Path, arguments: tuple[str, ...], where: str) -> None:
    done = run(project, *arguments)
    assert done.returncode == 1
    hiding = project / "interfaces.py"
    assert f"{where}{hiding} hides the package interfaces of VisualHFSM: rename it\n" in done.stdout
    assert done.stdout.count(str(hiding)) == 1
    assert "it was executed" not in done.stdout


@pytest.mark.parametrize(
    "test",
    [
        "def test_dance(behavior):\n    behavior('dance.xml')\n",
        "from interfaces.nao import PoseHeadPrx\n",
    ],
)
def test_it_is_named_by_pytest(project: Path, test: str) -> None:
    (project / "test_dance.py").write_text(test)
    done = run(project, "-m", "pytest", "-q", "--rootdir=.")
    assert (
        f"{project / 'interfaces.py'} hides the package interfaces of VisualHFSM: rename it\n" in done.stdout
    )
    assert "it was executed" not in done.stdout


@pytest.mark.parametrize("module", cases(["ballmover"], ["visualhfsm"]))
def test_it_is_found_wherever_python_looks(project: Path, tmp_path: Path, module: str) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    done = run(elsewhere, "-P", "-m", module, environment={"PYTHONPATH": str(project)})
    hiding = project / "interfaces.py"
    expected = f"{module}: error: {hiding} hides the package interfaces of VisualHFSM: rename it\n"
    assert (done.returncode, done.stdout) == (1, expected)


def test_a_robot_is_stopped_beside_it_all_the_same(project: Path) -> None:
    done = run(project, "-m", "nao_tools", "stop", "--help")
    assert done.returncode == 0


def test_a_folder_of_that_name_hides_nothing(tmp_path: Path) -> None:
    mine = tmp_path / "interfaces" / "mine.py"
    mine.parent.mkdir()
    mine.write_text("MINE = True\n")
    assert run(tmp_path, "-c", "import interfaces.mine, interfaces.nao").returncode == 0
    assert hidden_interfaces([str(tmp_path)]) == ""


def test_what_is_loaded_is_not_hidden_any_more(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    importlib.import_module("interfaces.hfsm")
    monkeypatch.syspath_prepend(project)
    assert hidden_interfaces([str(project)]) != ""
    assert hidden_interfaces() == ""
