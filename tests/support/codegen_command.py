"""Run the command `codegen`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from codegen.command import app
from tests.support.commands import run_here
from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT

__all__ = ["ROOT", "codegen", "files_in"]


def codegen(
    *arguments: str | Path, cwd: Path, environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run `codegen` in a directory to its end, with its output as text.

    It runs in this process, with its own environment in a separate one.
    """
    if environment is None:
        return run_here(app, "codegen", *arguments, cwd=cwd)
    return subprocess.run(
        [sys.executable, "-m", "codegen", *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )


def files_in(directory: Path) -> dict[str, str]:
    """Return the texts of all files below a directory, by relative path."""
    paths = (path for path in directory.rglob("*") if path.is_file())
    return {str(path.relative_to(directory)): path.read_text() for path in paths}
