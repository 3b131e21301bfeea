"""`codegen breaking`: report what would break a client or a server."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from codegen.diagnostics import Diagnostics, Location, Note

from .options import (
    INTERFACES,
    ErrorFormat,
    Format,
    Include,
    InterfaceFiles,
    report,
    require_directories,
    require_extensions,
)

if TYPE_CHECKING:
    from codegen.idl import ast
    from codegen.idl.breaking import BreakingChange
    from codegen.idl.lexer import Token
    from codegen.older_version import OlderVersion

__all__ = ["breaking"]


class Kind(StrEnum):
    """What a change has to break to be reported."""

    ANY = "any"
    WIRE = "wire"
    SOURCE = "source"


def breaking(
    files: InterfaceFiles,
    against: Annotated[
        str,
        typer.Option(
            "--against", metavar="REV|DIR", help="The older version: a git revision or a directory."
        ),
    ],
    include: Include = None,
    *,
    kind: Annotated[
        Kind, typer.Option("--kind", help="Report only what breaks programs as they run, or source code.")
    ] = Kind.ANY,
    ignore: Annotated[
        list[str] | None, typer.Option("--ignore", metavar="CODE", help="Leave out a rule; repeatable.")
    ] = None,
    error_format: Format = ErrorFormat.TEXT,
) -> None:
    """Report what changed that breaks clients or servers.

    A change breaks the wire when programs generated from the old files and from the new refuse each other,
    and source code when code written for the old files must change. A git revision is read without a
    checkout. The codes are explained in docs/breaking-changes.md. Exit code 1 when something breaks.
    """
    require_extensions(files, INTERFACES)
    directories = require_directories(include)
    from codegen.idl.breaking import Break, BreakingRule, breaking_changes
    from codegen.idl.loading import load_definitions
    from codegen.older_version import OlderVersionError, older_version

    ignored = set(ignore or ())
    unknown = ignored - {rule.code for rule in BreakingRule}
    if unknown:
        raise typer.BadParameter(f"there is no rule {', '.join(sorted(unknown))}", param_hint="--ignore")
    diagnostics = Diagnostics()
    new = load_definitions(files, directories, diagnostics)
    try:
        with older_version(against, files, directories) as older:
            old = _definitions_of_older(older, diagnostics)
            report(diagnostics, error_format, "")
            if not older.files:
                typer.echo(f"{against} has none of the files: nothing can break")
                return
            found = Diagnostics()
            for change in breaking_changes(old, new):
                wanted = kind is Kind.ANY or Break(kind.value) in change.rule.breaks
                if wanted and change.rule.code not in ignored:
                    _report_change(change, older, found)
    except OlderVersionError as error:
        raise typer.BadParameter(str(error), param_hint="--against") from error
    report(found, error_format, f"compared with {against}")
    typer.echo(f"nothing breaks, compared with {against}")


def _definitions_of_older(older: OlderVersion, diagnostics: Diagnostics) -> dict[str, ast.Definition]:
    """Return the older definitions; errors among them are reported under the names that people know."""
    from codegen.idl.loading import load_definitions

    found = Diagnostics()
    definitions = load_definitions(older.files, older.include, found)
    for each in found.errors:
        place = replace(each.location, path=older.shown(each.location.path))
        diagnostics.error(each.code, each.message, place)
    return definitions


def _report_change(change: BreakingChange, older: OlderVersion, diagnostics: Diagnostics) -> None:
    notes = [Note(f"breaks {' and '.join(change.rule.breaks)}: {change.rule.consequence}")]
    if change.before is not None:
        notes.append(Note("it was here", _place(change.before, older, diagnostics)))
    diagnostics.error(change.rule.code, change.message, _place(change.token, older, diagnostics), notes)


def _place(token: Token, older: OlderVersion, diagnostics: Diagnostics) -> Location:
    place = replace(token.location, path=older.shown(token.source.path))
    diagnostics.add_source(place.path, token.source.text)
    return place
