"""Arguments and options that several commands have."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from .reporting import ErrorFormat

INTERFACES = frozenset({".idl", ".ice"})
DOCUMENTS = frozenset({".xml"})

InterfaceFiles = Annotated[
    list[Path], typer.Argument(metavar="FILES", help="Interfaces in Slice (.idl, .ice).")
]
Include = Annotated[
    list[Path] | None,
    typer.Option("-I", "--include", metavar="DIR", help="Search DIR for included files; repeatable."),
]
Format = Annotated[
    ErrorFormat,
    typer.Option("--error-format", help="How diagnostics are written to stderr."),
]


def require_extensions(paths: Iterable[Path], allowed: frozenset[str]) -> None:
    """Refuse files that a command has no use for as wrong usage."""
    for path in paths:
        if path.suffix.lower() not in allowed:
            *others, last = sorted(allowed)
            names = f"{', '.join(others)} or {last}" if others else last
            raise typer.BadParameter(f"{path}: expected {names}", param_hint="FILES")


def require_directories(paths: Iterable[Path] | None) -> list[Path]:
    """Return directories to search, or refuse what is none as wrong usage."""
    directories = list(paths or ())
    for directory in directories:
        if not directory.is_dir():
            raise typer.BadParameter(f"{directory} is not a directory", param_hint="-I")
    return directories
