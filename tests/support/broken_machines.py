"""Machines that are broken by namespaces and variables, and what `nao doctor` finds there."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final, NamedTuple

import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT

__all__ = ["SELF", "Found", "broken", "examined", "run"]

SELF: Final = [sys.executable, "-P", "-m"]
DOCTOR: Final = [*SELF, "nao_tools", "doctor", "--json"]


class Found(NamedTuple):
    """The findings of a command, as lines."""

    code: int
    lines: list[str]

    def having(self, text: str) -> str:
        """Return the only finding that has a text."""
        (line,) = (each for each in self.lines if text in each)
        return line


def broken(folder: Path, *steps: str, then: str = "", needs: tuple[str, ...] = ()) -> list[str]:
    """Return what makes a command run in a folder, in separate namespaces, after steps of a shell that break them."""
    for program in ("unshare", "mount", *needs):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed")
    apart = [
        "unshare",
        "--map-root-user",
        "--net",
        "--mount",
        "--pid",
        "--fork",
        "--kill-child",
        "--mount-proc",
    ]
    begin = ["set -e", f"cd '{folder}'", *steps]
    built = run([*apart, "sh", "-c", "\n".join(begin)])
    if built.returncode:
        pytest.skip(f"such a machine cannot be made here: {built.stderr.strip()}")
    return [*apart, "sh", "-c", "\n".join([*begin, then, 'exec env PATH="$SEARCHED" "$@"']), "sh"]


def run(command: list[str], **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a command to its end; `SEARCHED` is the PATH behind the steps that break the machine."""
    variables = {
        **os.environ,
        "PYTHON": sys.executable,
        "SEARCHED": os.environ["PATH"],
        "PYTHONPATH": str(ROOT),
    }
    return subprocess.run(
        command,
        env={**variables, **environment},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )


def examined(command: list[str], *words: str, **environment: str) -> Found:
    """Run `nao doctor` behind a command."""
    done = run([*command, *DOCTOR, *words], **environment)
    assert done.stdout.startswith("["), done
    found = json.loads(done.stdout)
    return Found(done.returncode, [f"{each['level']} {each['text']} | {each['fix']}" for each in found])
