"""`codegen fmt`: lay out interface files in the canonical way."""

from __future__ import annotations

from typing import Annotated

import typer

from codegen.diagnostics import Diagnostics
from codegen.files import FilesNotWrittenError, GeneratedFile, apply, compare_with_disk, diff

from .options import (
    INTERFACES,
    ErrorFormat,
    Format,
    InterfaceFiles,
    report,
    require_extensions,
)

__all__ = ["fmt"]


def fmt(
    files: InterfaceFiles,
    *,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; exit 1 with a diff if a file would change.")
    ] = False,
    error_format: Format = ErrorFormat.TEXT,
) -> None:
    """Lay out interface files in the one canonical way.

    Comments stay, and so does every meaning. When a file has errors in its syntax, none is touched.
    """
    require_extensions(files, INTERFACES)
    from codegen.idl.formatter import FormattingError, format_file

    diagnostics = Diagnostics()
    formatted: list[GeneratedFile] = []
    try:
        for path in files:
            text = format_file(path, diagnostics)
            if text is not None:
                formatted.append(GeneratedFile(path, text))
        report(diagnostics, error_format)
        changes = compare_with_disk(formatted)
        if check:
            if changes:
                typer.echo(diff(changes), nl=False)
                typer.echo(f"{len(changes.write)} of {len(formatted)} files would change", err=True)
                raise typer.Exit(1)
            return
        apply(changes)
    except (FormattingError, FilesNotWrittenError) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from error
    for file in changes.write:
        typer.echo(f"formatted {file.path}")
    unchanged = len(formatted) - len(changes.write)
    if unchanged:
        typer.echo(f"{unchanged} files left as they are" if unchanged > 1 else "1 file left as it is")
