"""Show what was found wrong, and end a command as that demands."""

from __future__ import annotations

import os
import sys
from enum import StrEnum

import typer

from codegen.diagnostic_formats import as_github, as_json
from codegen.diagnostics import Diagnostics

__all__ = ["ErrorFormat", "report", "show"]


class ErrorFormat(StrEnum):
    """For whom diagnostics are written: people, programs, or the annotations of a pull request."""

    TEXT = "text"
    JSON = "json"
    GITHUB = "github"


def show(
    diagnostics: Diagnostics, error_format: ErrorFormat, outcome: str | None = "nothing was written"
) -> None:
    """Write everything found to stderr, with the outcome of errors, if any, where people read it."""
    match error_format:
        case ErrorFormat.TEXT:
            text = diagnostics.render(color=_wants_color(), outcome=outcome)
        case ErrorFormat.JSON:
            text = as_json(diagnostics)
        case ErrorFormat.GITHUB:
            text = as_github(diagnostics)
    if text:
        typer.echo(text, err=True)


def report(diagnostics: Diagnostics, error_format: ErrorFormat, outcome: str = "nothing was written") -> None:
    """Write everything found to stderr, and end the command with exit code 1 when there is an error."""
    show(diagnostics, error_format, outcome)
    if diagnostics.has_errors:
        raise typer.Exit(1)


def _wants_color() -> bool:
    return sys.stderr.isatty() and "NO_COLOR" not in os.environ and os.environ.get("TERM") != "dumb"
