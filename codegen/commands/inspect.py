"""`codegen fingerprint`, `describe` and `decode`: what interface files say, without generating anything."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

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

__all__ = ["decode", "describe", "fingerprint"]

_MEBIBYTE = 1 << 20

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
    from codegen.idl.fingerprint import canonical_definition
    from codegen.idl.fingerprint import fingerprint as digest

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

    It prints the documentation, what travels, with an example in JSON and in bytes, and the fingerprint.
    """
    definitions = _load(files, include, error_format)
    from codegen.idl.describe import describe as description

    typer.echo(description(_find(name, definitions)))


def decode(
    name: TypeName,
    files: InterfaceFiles,
    include: Include = None,
    *,
    arguments: Annotated[
        bool, typer.Option("--arguments", help="Of an operation, read the arguments and not the results.")
    ] = False,
    max_size: Annotated[
        int | None,
        typer.Option(
            "--max-size", metavar="MIB", min=1, help="Largest payload; 1, or 32 where bytes are sent."
        ),
    ] = None,
    error_format: Format = ErrorFormat.TEXT,
) -> None:
    """Check a payload from stdin and print it as JSON.

    Bytes are printed in base64, enumerators by name, numbers that are not finite as text. The payload may
    come from anywhere: it is checked byte by byte, and what does not fit is reported with its place.
    """
    definitions = _load(files, include, error_format)
    from codegen.idl import ast
    from codegen.idl.payload_reader import PayloadError, PayloadReader
    from codegen.idl.wire_shape import Part, holds_bytes

    definition = _find(name, definitions)
    if isinstance(definition, ast.Interface | ast.Constant):
        message = f"{definition.kind} `{name}` does not travel: name a type or an operation"
        raise typer.BadParameter(message, param_hint="TYPE")
    part = Part.ARGUMENTS if arguments else Part.RESULT
    limit = (max_size or (32 if holds_bytes(definition, part) else 1)) * _MEBIBYTE
    payload = sys.stdin.buffer.read(limit + 1)
    if len(payload) > limit:
        _fail(f"the payload is larger than {limit // _MEBIBYTE} MiB; --max-size allows more")
    reader = PayloadReader(payload, definitions)
    try:
        value = reader.read(definition, part)
    except PayloadError as error:
        _fail(f"the payload is no {definition.scoped}: {error}")
    for place in reader.ignored:
        typer.echo(f"ignored, as the type has no such member: {place}", err=True)
    typer.echo(_printable(json.dumps(value, indent=2, ensure_ascii=False)))


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


def _find(name: str, definitions: Mapping[str, ast.Definition]) -> ast.Definition:
    from codegen.idl.loading import UnknownNameError, find_definition

    try:
        return find_definition(name, definitions)
    except UnknownNameError as error:
        raise typer.BadParameter(str(error), param_hint="TYPE") from error


def _fail(message: str) -> NoReturn:
    typer.echo(_printable(message), err=True)
    raise typer.Exit(1)


def _printable(text: str) -> str:
    """Return text that does nothing to a terminal but to stand there; in JSON it means the same."""
    return "".join(
        character if character.isprintable() or character == "\n" else _escaped(character)
        for character in text
    )


def _escaped(character: str) -> str:
    units = character.encode("utf-16-be")
    return "".join(f"\\u{units[start : start + 2].hex()}" for start in range(0, len(units), 2))
