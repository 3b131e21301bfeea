"""Run a command in this process: it prints and ends as in a separate one, which takes long to start."""

from __future__ import annotations

import contextlib
import io
import runpy
import signal
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

import typer
from typer.testing import CliRunner

from zenoh_ice import ZenohIceError

__all__ = ["run_file_here", "run_here"]

_STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def run_here(
    app: typer.Typer,
    program: str,
    *arguments: str | Path,
    cwd: Path = Path(),
    expected: tuple[type[Exception], ...] = (),
    stdin: bytes = b"",
    columns: int = 120,
    limits: object = None,
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end in a folder, the working directory by default, with its output as text.

    Errors of ours and of the `expected` types become one line on stderr, as with `zenoh_ice.application.cli.run`.
    `limits` are those that the command takes from its context.
    """
    words = [*map(str, arguments)]
    with contextlib.chdir(cwd):
        environment = {"COLUMNS": str(columns)}
        result = CliRunner().invoke(app, words, prog_name=program, input=stdin, env=environment, obj=limits)
    code, errors, problem = result.exit_code, result.stderr, result.exception
    if isinstance(problem, (ZenohIceError, *expected)):
        code, errors = 1, f"{errors}{program}: error: {' '.join(str(problem).split())}\n"
    elif problem is not None and not isinstance(problem, SystemExit):
        raise problem
    return subprocess.CompletedProcess([program, *words], code, result.stdout, errors)


def run_file_here(file: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a file as `python FILE ARGUMENTS...` does, to its end; `stdout` has all its output.

    For a component that is not ended by a signal.
    """
    words, output = [str(file), *map(str, arguments)], io.StringIO()
    handlers = {number: signal.getsignal(number) for number in _STOPPING}
    code: object = 0
    try:
        with (
            patch.multiple(sys, argv=words, path=[str(file.parent), *sys.path]),
            contextlib.redirect_stdout(output),
            contextlib.redirect_stderr(output),
        ):
            runpy.run_path(str(file), run_name="__main__")
    except SystemExit as end:
        code = end.code
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    assert code is None or isinstance(code, int), code
    return subprocess.CompletedProcess(words, code or 0, output.getvalue())
