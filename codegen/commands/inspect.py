"""`codegen fingerprint` and `describe`: what interface files say, without generating anything."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from codegen.diagnostics import Diagnostics

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

__all__ = ["describe", "fingerprint"]

TypeName = Annotated[
    str, typer.Argument(metavar="TYPE", help="A type or an operation: nao::HeadPose, PoseHead::getPose.")
]


def fingerprint(
    files: InterfaceFiles,
    include: Include = None,
    *,
    error_format: Format = ErrorFormat.TEXT,
) -> None:
    """Print the fingerprints of interfaces and types.

    Programs understand each other when the fingerprints of their interfaces are the same. Comments, the
    order of definitions and the names of files do not count.
    """
    from codegen.idl import ast
    from codegen.idl.schema import canonical_definition
    from codegen.idl.schema import fingerprint as digest

    given = {path.resolve() for path in files}
    for scoped, definition in sorted(_load(files, include, error_format).items()):
        if definition.token.source.path.resolve() in given and not isinstance(definition, ast.Constant):
            typer.echo(f"{digest(canonical_definition(definition))}  {definition.kind} {scoped}")


def describe(
    name: TypeName,
    files: InterfaceFiles,
    include: Include = None,
    *,
    error_format: Format = ErrorFormat.TEXT,
) -> None:
    """Explain a type, an interface or an operation.

    It prints the documentation, what travels, and the fingerprint.
    """
    from codegen.idl.describe import UnknownNameError, find_definition
    from codegen.idl.describe import describe as description

    definitions = _load(files, include, error_format)
    try:
        definition = find_definition(name, definitions)
    except UnknownNameError as error:
        raise typer.BadParameter(str(error), param_hint="TYPE") from error
    typer.echo(description(definition))


def _load(
    files: Sequence[Path], include: Sequence[Path] | None, error_format: ErrorFormat
) -> dict[str, ast.Definition]:
    """Return what files and all that they include define; end the command when they have errors."""
    require_extensions(files, INTERFACES)
    directories = require_directories(include)
    from codegen.idl.loading import load_definitions

    diagnostics = Diagnostics()
    definitions = load_definitions(files, directories, diagnostics)
    report(diagnostics, error_format, "")
    return definitions
