"""docs/how-to/own-project.md: its commands run in an empty folder, with the packages installed.

They are copied as an installation copies them: nothing of the checkout is on the path.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import msgspec
import pytest

from tests.integration.test_docs_interfaces import commands, matches
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.places import ROOT

SCRIPT = """#!{python}
import sys
from {module} import {name}
sys.exit({name}())
"""


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    """An environment with our packages and the libraries of this one; return the folder of its programs."""
    home = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", home], check=True, timeout=RUN_LIMIT)
    (packages,) = home.glob("lib/python*/site-packages")
    libraries = Path(msgspec.__file__).parents[1]
    (packages / "libraries.pth").write_text(f"{libraries}\n")  # its own .pth, of the checkout, does not count
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    for name in project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]:
        shutil.copytree(ROOT / name, packages / name)
    for name, entry in project["project"]["scripts"].items():
        module, _, function = entry.partition(":")
        program = home / "bin" / name
        program.write_text(SCRIPT.format(python=home / "bin" / "python", module=module, name=function))
        program.chmod(0o755)
    pytest_program = home / "bin" / "pytest"
    pytest_program.write_text(
        SCRIPT.format(python=home / "bin" / "python", module="pytest", name="console_main")
    )
    pytest_program.chmod(0o755)
    return home / "bin"


@pytest.mark.slow
@pytest.mark.sim
def test_the_page_works_in_an_empty_folder(tmp_path: Path, programs: Path) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    environment["PATH"] = f"{programs}{os.pathsep}{environment['PATH']}"
    where = "import interfaces.nao as found; print(found.__file__)"
    found = subprocess.run(
        [programs / "python", "-c", where], env=environment, cwd=folder, capture_output=True
    )
    assert found.stdout.decode().startswith(str(tmp_path)), "the checkout is on the path"
    ran = 0
    for block in blocks_of((DOCS / "how-to" / "own-project.md").read_text("utf-8")):
        if block.language != "console":
            continue
        for command, expected in commands(block.text):
            if command.startswith("cd "):
                folder /= command.removeprefix("cd ")
                continue
            done = subprocess.run(
                command,
                shell=True,
                cwd=folder,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=RUN_LIMIT,
                check=False,
            )
            output = done.stdout.decode()
            assert done.returncode == 0, f"{command}: {output}"
            assert matches(expected.strip(), output.strip()), f"{command}: {output}"
            ran += 1
    assert ran == 4
