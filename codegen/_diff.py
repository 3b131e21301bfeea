"""The command `codegen diff`: which changes of interfaces make programs refuse each other."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from codegen.diagnostics import Diagnostics
from codegen.files import is_regular

from . import options

if TYPE_CHECKING:
    from codegen._idl.changes import DefinitionChange, Refusal

app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False, add_completion=False)

_EPILOG: Final = """Examples:

\b
  codegen diff old/lamp.idl lamp.idl
  codegen diff released/interfaces interfaces -I shared
  codegen diff --format json old new

Exit codes: 0 no breaking change, 1 breaking changes, 2 trouble, such as files with errors.
See docs/how-to/version-control.md for details."""

_PATHS: Final = "an interface (.idl, .ice), or a directory with some."


@app.command(epilog=_EPILOG)
def diff(
    old: Annotated[Path, typer.Argument(metavar="OLD", help=f"The former version: {_PATHS}")],
    new: Annotated[Path, typer.Argument(metavar="NEW", help=f"The later version: {_PATHS}")],
    include: Annotated[
        list[Path] | None,
        typer.Option("-I", "--include", metavar="DIR", help="Search DIR for included files; repeatable."),
    ] = None,
    *,
    output_format: Annotated[
        options.DiffFormat, typer.Option("--format", help="Format of the changes.")
    ] = options.DiffFormat.TEXT,
) -> None:
    """List the changes between two versions of interfaces, breaking ones first.

    A change is breaking if clients and servants that were generated from the two versions refuse each other,
    as their fingerprints differ: also an operation more is one. So is a definition that is gone. What else
    changes, such as descriptions, default values and new interfaces, is compatible.
    """
    # Imported here: the compiler takes a while.
    from codegen._idl import read_definitions
    from codegen._idl.changes import changes, refusals

    directories = options.require_directories(include)
    diagnostics = Diagnostics()
    before, after = (
        read_definitions(_files(path), [*([path] if path.is_dir() else []), *directories], diagnostics)
        for path in (old, new)
    )
    if diagnostics.has_errors:
        options.show(diagnostics, options.ErrorFormat.TEXT, outcome=None)
        raise typer.Exit(options.DiffResult.TROUBLE)
    found = sorted(changes(before, after), key=lambda change: not change.breaking)
    refused = [*refusals(before, after)]
    text = _as_json(found, refused) if output_format is options.DiffFormat.JSON else _as_text(found, refused)
    typer.echo(text, nl=bool(text))
    is_breaking = bool(refused) or any(change.breaking for change in found)
    raise typer.Exit(options.DiffResult.DIFFERENT if is_breaking else options.DiffResult.SAME)


def _files(path: Path) -> list[Path]:
    """Return the interfaces in a directory, or the one that is named; refuse others as wrong usage."""
    if not path.is_dir():
        options.require_extensions([path], options.INTERFACES)
        return [path]
    found = sorted(
        each for each in path.rglob("*") if each.suffix.lower() in options.INTERFACES and is_regular(each)
    )
    if not found:
        raise typer.BadParameter(f"{path} has no interfaces", param_hint="OLD/NEW")
    return found


def _as_text(changes: Sequence[DefinitionChange], refused: Sequence[Refusal]) -> str:
    lines = [
        f"{change.location.path}:{change.location.line}:{change.location.column}: "
        f"{'breaking' if change.breaking else 'compatible'}: {change}"
        for change in changes
    ]
    if refused:
        names = ", ".join(each.interface.removeprefix("::") for each in refused)
        lines.append(f"programs of the two versions refuse each other at: {names}")
    return "\n".join(lines)


def _as_json(changes: Sequence[DefinitionChange], refused: Sequence[Refusal]) -> str:
    """Return the changes as a JSON object, with the interfaces at which programs refuse each other."""
    listed = [
        {
            **{key: value for key, value in asdict(change).items() if key != "location" and value != ""},
            "message": str(change),
            "path": str(change.location.path),
            "line": change.location.line,
            "column": change.location.column,
        }
        for change in changes
    ]
    return json.dumps({"changes": listed, "refused": [asdict(each) for each in refused]}, indent=1)
