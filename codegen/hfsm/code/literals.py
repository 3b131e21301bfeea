"""Write values and texts down as Python."""

from __future__ import annotations

__all__ = ["docstring", "literal", "printable", "quoted"]


def literal(value: object) -> str:
    """Return a value as a literal; texts stand in double quotes."""
    return quoted(value) if isinstance(value, str) else repr(value)


def quoted(text: str) -> str:
    """Return a string literal with double quotes wherever that needs no escape."""
    written = repr(text)
    return f'"{written[1:-1]}"' if written.startswith("'") and '"' not in text else written


def docstring(text: str) -> str:
    """Return a text that can stand between triple quotes."""
    visible = "".join(character if character.isprintable() else " " for character in text)
    escaped = visible.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    return f'{escaped[:-1]}\\"' if escaped.endswith('"') else escaped


def printable(name: str) -> str:
    """Return the name of a file as it can stand in a comment."""
    return "".join(character if character.isprintable() else "_" for character in name)
