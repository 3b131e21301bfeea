"""Run the command `codegen` in a separate process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.support.limits import RUN_LIMIT

ROOT = Path(__file__).parents[2]


def codegen(
    *arguments: str | Path, cwd: Path, input: bytes = b"", environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run `codegen` in a directory to its end, with its output as text."""
    command = [sys.executable, "-m", "codegen", *map(str, arguments)]
    done = subprocess.run(
        command,
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "120", **(environment or {})},
        input=input,
        capture_output=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    return subprocess.CompletedProcess(command, done.returncode, done.stdout.decode(), done.stderr.decode())


def files_in(directory: Path) -> dict[str, str]:
    """Return the texts of all files below a directory, by relative path."""
    paths = (path for path in directory.rglob("*") if path.is_file())
    return {str(path.relative_to(directory)): path.read_text() for path in paths}
