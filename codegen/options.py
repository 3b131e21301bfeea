"""Code that `codegen` and `visualhfsm` share: checks of arguments, and the output of diagnostics."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from enum import IntEnum, StrEnum
from pathlib import Path

import typer

from codegen.diagnostics import Diagnostics, as_github, as_json

INTERFACES = frozenset({".idl", ".ice"})
DOCUMENTS = frozenset({".xml"})


class ErrorFormat(StrEnum):
    """The format of diagnostics: for people, for programs, or as annotations of a pull request."""

    TEXT = "text"
    JSON = "json"
    GITHUB = "github"


class DiffFormat(StrEnum):
    """The format of a comparison: for people or for programs."""

    TEXT = "text"
    JSON = "json"


class DiffResult(IntEnum):
    """The exit codes of a comparison, which are those of `diff`."""

    SAME = 0
    DIFFERENT = 1
    TROUBLE = 2


def require_extensions(paths: Iterable[Path], allowed: frozenset[str]) -> None:
    """Raise a usage error for files that a command cannot read."""
    for path in paths:
        if path.suffix.lower() not in allowed:
            if not path.exists():
                raise typer.BadParameter(f"{path} does not exist", param_hint="FILES")
            *others, last = sorted(allowed)
            names = f"{', '.join(others)} or {last}" if others else last
            raise typer.BadParameter(f"{path}: expected {names}", param_hint="FILES")


def require_directories(paths: Iterable[Path] | None) -> list[Path]:
    """Return the directories to search; raise a usage error for anything else."""
    directories = list(paths or ())
    for directory in directories:
        if not directory.is_dir():
            raise typer.BadParameter(f"{directory} is not a directory", param_hint="-I")
    return directories


def show(
    diagnostics: Diagnostics, error_format: ErrorFormat, outcome: str | None = "nothing was written"
) -> None:
    """Write all diagnostics to stderr; the text format also has the outcome, if there are errors."""
    match error_format:
        case ErrorFormat.TEXT:
            text = diagnostics.render(color=_wants_color(), outcome=outcome)
        case ErrorFormat.JSON:
            text = as_json(diagnostics)
        case ErrorFormat.GITHUB:
            text = as_github(diagnostics)
    if text:
        typer.echo(text, err=True)


def report(diagnostics: Diagnostics, error_format: ErrorFormat) -> None:
    """Write all diagnostics to stderr, and exit with code 1 if there is an error."""
    show(diagnostics, error_format)
    if diagnostics.has_errors:
        raise typer.Exit(1)


def _wants_color() -> bool:
    return sys.stderr.isatty() and "NO_COLOR" not in os.environ and os.environ.get("TERM") != "dumb"
