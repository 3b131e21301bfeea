"""The command `codegen`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from .diagnostics import Diagnostics
from .files import FilesNotWrittenError, GeneratedFile, apply, compare_with_disk, diff

_INTERFACES = frozenset({".idl", ".ice"})
_DOCUMENTS = frozenset({".xml"})

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command(
    epilog="""Examples:

\b
  codegen interfaces/*.idl              packages beside the files: interfaces/jderobot, ...
  codegen robot.idl -I slice -o api     the package api/, with includes found in slice/
  codegen behaviors/follow_ball.xml     the component behaviors/follow_ball.py
  codegen --check interfaces/*.idl      exit 1 and show a diff when something is stale

Exit codes: 0 done, 1 errors in the files or, with --check, something stale, 2 wrong usage.""",
)
def codegen(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILES...", help="Interfaces in Slice (.idl, .ice) and automata (.xml)."),
    ],
    include: Annotated[
        list[Path] | None,
        typer.Option("-I", "--include", metavar="DIR", help="Search DIR for included files; repeatable."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Write to DIR instead of beside the files."),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; exit 1 with a diff if files are stale.")
    ] = False,
) -> None:
    """Generate Python from interfaces in Slice and from automaton documents.

    Interfaces become packages of typed structs, proxies and servants; an automaton document becomes a
    component that runs it. All files are written, or none when there is an error; a file that would not
    change is not touched.
    """
    interfaces = [path for path in files if path.suffix.lower() in _INTERFACES]
    documents = [path for path in files if path.suffix.lower() in _DOCUMENTS]
    for path in files:
        if path.suffix.lower() not in _INTERFACES | _DOCUMENTS:
            raise typer.BadParameter(f"{path}: expected .idl, .ice or .xml", param_hint="FILES")
    for directory in include or []:
        if not directory.is_dir():
            raise typer.BadParameter(f"{directory} is not a directory", param_hint="-I")
    if output is not None and output.exists() and not output.is_dir():
        raise typer.BadParameter(f"{output} is not a directory", param_hint="-o")

    diagnostics = Diagnostics()
    generated: list[GeneratedFile] = []
    leftovers: list[Path] = []
    if interfaces:
        from .idl import compile_interfaces

        compilation = compile_interfaces(interfaces, include or [], output, diagnostics)
        generated += compilation.files
        leftovers += compilation.leftovers
    if documents:
        from .hfsm import compile_document

        for path in documents:
            generated += compile_document(path, output, diagnostics, include or ()) or []
    if len(diagnostics):
        typer.echo(diagnostics.render(color=_wants_color()), err=True)
    if diagnostics.has_errors:
        raise typer.Exit(1)
    _finish(generated, leftovers, check=check)


def _finish(generated: list[GeneratedFile], leftovers: list[Path], *, check: bool) -> None:
    """Write what changed and tell it, or only show it."""
    try:
        changes = compare_with_disk(generated, leftovers)
        if check:
            if changes:
                typer.echo(diff(changes), nl=False)
                count = len(changes.write) + len(changes.remove)
                typer.echo(f"{count} of {len(generated) + len(leftovers)} files are stale", err=True)
                raise typer.Exit(1)
            return
        apply(changes)
    except FilesNotWrittenError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from error
    except OSError as error:
        typer.echo(f"{error.filename}: {error.strerror}", err=True)
        raise typer.Exit(1) from error
    for file in changes.write:
        typer.echo(f"wrote {file.path}")
    for path in changes.remove:
        typer.echo(f"removed {path}")
    unchanged = len(generated) - len(changes.write)
    if unchanged:
        typer.echo(f"{unchanged} file{'s' if unchanged > 1 else ''} up to date")


def _wants_color() -> bool:
    return sys.stderr.isatty() and "NO_COLOR" not in os.environ and os.environ.get("TERM") != "dumb"
