"""Write diagnostics for programs: as JSON, or as annotations of a pull request on GitHub."""

from __future__ import annotations

import json
from typing import Any

from .diagnostics import Diagnostic, Diagnostics, Location, Severity

__all__ = ["as_github", "as_json"]

_GITHUB_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}


def as_json(diagnostics: Diagnostics) -> str:
    """Return everything found as a JSON array with an object a line, `[]` when there is nothing.

    Lines and columns count from 1; a diagnostic that means a file as a whole has neither.
    """
    if not len(diagnostics):
        return "[]"
    return "[\n" + ",\n".join(json.dumps(_object(found)) for found in diagnostics) + "\n]"


def _object(found: Diagnostic) -> dict[str, Any]:
    return {
        "severity": str(found.severity),
        "code": str(found.code),
        "message": found.message,
        **_place(found.location),
        "notes": [
            {"message": note.message, **(_place(note.location) if note.location else {})}
            for note in found.notes
        ],
    }


def _place(location: Location) -> dict[str, Any]:
    if not location.line:
        return {"path": str(location.path)}
    return {
        "path": str(location.path),
        "line": location.line,
        "column": location.column,
        "length": location.length,
    }


def as_github(diagnostics: Diagnostics) -> str:
    """Return everything found as workflow commands, one a line."""
    return "\n".join(_command(found) for found in diagnostics)


def _command(found: Diagnostic) -> str:
    place = found.location
    properties = {"file": str(place.path)}
    if place.line:
        properties["line"] = str(place.line)
        properties["col"] = str(place.column)
        properties["endColumn"] = str(place.column + place.length)
    properties["title"] = f"codegen {found.code}"
    listed = ",".join(f"{name}={_escaped(value, ',:')}" for name, value in properties.items())
    notes = [
        f"note: {note.message}" + (f" ({note.location})" if note.location else "") for note in found.notes
    ]
    text = "\n".join([found.message, *notes])
    return f"::{_GITHUB_LEVELS[found.severity]} {listed}::{_escaped(text)}"


def _escaped(text: str, special: str = "") -> str:
    """Return text in which what ends a workflow command, or one of its properties, is escaped."""
    return "".join(
        f"%{ord(character):02X}" if character in "%\r\n" or character in special else character
        for character in text
    )
