"""The programs where no extra is installed: they show their help, and name what they lack."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from tests.support.limits import START_LIMIT
from tests.support.places import ROOT
from tests.support.plugins import needs
from tools.workspace import CORE, EXTRAS, PLUG_INS

pytestmark = pytest.mark.slow

PROJECT: Final = CORE.project
SCRIPTS: Final = {
    name: entry for each in (CORE, *PLUG_INS) for name, entry in each.project.get("scripts", {}).items()
}
MODULES: Final = {"pillow": "PIL", "opencv-python-headless": "cv2"}
"""The names by which packages are imported that have another one."""
PRESENT: Final = {"markdown_it_py"}
"""What extras name and is there without: it comes with Rich."""
WITHOUT: Final = """
import sys
class Without:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Without())
"""


def names(requirements: list[str]) -> set[str]:
    found = {
        re.split(r"[^\w.-]", each)[0].lower() for each in requirements if not each.startswith("visualhfsm")
    }
    return {MODULES.get(each, each.replace("-", "_")) for each in found}


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """An environment in which only what every installation has can be imported."""
    extras = [each for extra in EXTRAS.values() for each in extra]
    extras += [each for plug_in in PLUG_INS for each in plug_in.project["dependencies"]]
    absent = names(extras) - names(PROJECT["dependencies"]) - PRESENT
    (tmp_path / "sitecustomize.py").write_text(WITHOUT.format(names=absent), "utf-8")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}


def run(entry: str, arguments: list[str], environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    module, _, function = entry.partition(":")
    code = f"import sys; sys.argv[0] = 'program'; from {module} import {function} as f; f()"
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, env=environment, timeout=START_LIMIT, check=False
    )


@pytest.mark.parametrize("program", SCRIPTS)
def test_a_program_shows_its_help(program: str, environment: dict[str, str]) -> None:
    done = run(SCRIPTS[program], ["--help"], environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert "Usage: " in done.stdout


@needs("visualhfsm_match")
@pytest.mark.parametrize("command", ["tournament", "match"])
def test_what_a_match_lacks_is_named(command: str, environment: dict[str, str], tmp_path: Path) -> None:
    document = tmp_path / "a.xml"
    document.write_text("")
    given = [str(tmp_path)] if command == "tournament" else [str(document)] * 2
    done = run(SCRIPTS["visualhfsm"], [command, *given], environment)
    assert done.returncode == 1
    assert "MuJoCo is not installed; install it with: pip install 'visualhfsm[sim]'" in done.stderr
    assert "Traceback" not in done.stderr
