"""Run a command in this process: it prints and ends as in a separate one, which takes long to start."""

from __future__ import annotations

import contextlib
import subprocess
from pathlib import Path

import typer
from typer.testing import CliRunner

from zenoh_ice import ZenohIceError

__all__ = ["run_here"]


def run_here(
    app: typer.Typer,
    program: str,
    *arguments: str | Path,
    cwd: Path = Path(),
    expected: tuple[type[Exception], ...] = (),
    stdin: bytes = b"",
    columns: int = 120,
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end in a folder, the working directory by default, with its output as text.

    Errors of ours and of the `expected` types become one line on stderr, as with `hfsm_command.cli.run`.
    """
    words = [*map(str, arguments)]
    with contextlib.chdir(cwd):
        result = CliRunner().invoke(app, words, prog_name=program, input=stdin, env={"COLUMNS": str(columns)})
    code, errors, problem = result.exit_code, result.stderr, result.exception
    if isinstance(problem, (ZenohIceError, *expected)):
        code, errors = 1, f"{errors}{program}: error: {' '.join(str(problem).split())}\n"
    elif problem is not None and not isinstance(problem, SystemExit):
        raise problem
    return subprocess.CompletedProcess([program, *words], code, result.stdout, errors)
