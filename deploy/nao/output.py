"""Write results: pretty and in color for a person at a terminal, plain otherwise, as JSON for a program."""

from __future__ import annotations

import json
import shutil
import sys
from typing import TYPE_CHECKING, Final

from deploy.nao.values import Json

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["console", "for_people", "note", "pretty", "print_json", "print_line", "print_value", "width"]

_INDENT: Final = 2
_MOST_ITEMS: Final = 32
"""Items of a list that are shown to a person; some more, if those are all."""
_FEW: Final = 8
_DIGITS: Final = 6
"""Significant digits of a number that are shown to a person."""
_LONGEST_TEXT: Final = 2000


def for_people() -> bool:
    """Return whether standard output is a terminal."""
    return sys.stdout.isatty()


def width() -> int:
    """Return how many columns there are to write on."""
    return shutil.get_terminal_size((100, 24)).columns


def console() -> Console:
    """Return what writes tables and colors; colors only on a terminal."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=False, width=None if for_people() else width())


def note(text: str) -> None:
    """Write a person something beside the result; programs do not get it."""
    if sys.stderr.isatty():
        from rich.console import Console
        from rich.text import Text

        Console(stderr=True, highlight=False).print(Text(text, style="dim"))


def print_line(text: str) -> None:
    """Print a line as it is."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def print_json(value: Json) -> None:
    """Print a value as JSON on one line."""
    print_line(json.dumps(value, ensure_ascii=False, allow_nan=False))


def print_value(value: Json) -> None:
    """Print a value so that a person can read it."""
    if not for_people():
        print_line(pretty(value, width(), whole=True))
        return
    from rich.highlighter import JSONHighlighter
    from rich.text import Text

    text = Text(pretty(value, width()))
    JSONHighlighter().highlight(text)
    console().print(text, soft_wrap=True)


def pretty(value: Json, columns: int, *, whole: bool = False) -> str:
    """Return a value as JSON in which what fits stands on one line.

    Unless it is to be `whole`, long lists and texts are cut, and numbers rounded.
    """
    return _layout(value if whole else _cut(value), columns, 0, 0)


class _More(int):
    """So many items of a list that are not shown."""


def _cut(value: Json) -> Json:
    match value:
        case dict():
            return {key: _cut(item) for key, item in value.items()}
        case list():
            shown = len(value) if len(value) <= _MOST_ITEMS + _FEW else _MOST_ITEMS
            more = [_More(len(value) - shown)] if shown < len(value) else []
            return [*map(_cut, value[:shown]), *more]
        case str() if len(value) > _LONGEST_TEXT:
            return f"{value[:_LONGEST_TEXT]}..."
        case float():
            return float(f"{value:.{_DIGITS}g}")
    return value


def _layout(value: Json, columns: int, indent: int, before: int) -> str:
    """Return a value that begins `before` characters into a line."""
    flat = _flat(value)
    if not isinstance(value, dict | list) or not value or before + len(flat) < columns:
        return flat
    margin = " " * (indent + _INDENT)
    if isinstance(value, dict):
        entries = [(f"{margin}{_flat(key)}: ", item) for key, item in value.items()]
    elif any(isinstance(item, dict | list) for item in value):
        entries = [(margin, item) for item in value]
    else:
        return f"[\n{_filled([_flat(item) for item in value], columns, margin)}\n{' ' * indent}]"
    body = ",\n".join(
        head + _layout(item, columns - 1, indent + _INDENT, len(head)) for head, item in entries
    )
    return ("{%s}" if isinstance(value, dict) else "[%s]") % f"\n{body}\n{' ' * indent}"


def _filled(items: list[str], columns: int, margin: str) -> str:
    """Return plain items in lines that are as long as they may be."""
    lines = [margin + items[0]]
    for item in items[1:]:
        if len(lines[-1]) + len(item) + 3 > columns:
            lines.append(margin + item)
        else:
            lines[-1] += f", {item}"
    return ",\n".join(lines)


def _flat(value: Json) -> str:
    match value:
        case _More():
            return f"... {int(value)} more"
        case dict():
            return "{" + ", ".join(f"{_flat(key)}: {_flat(item)}" for key, item in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(_flat, value)) + "]"
    text = json.dumps(value, ensure_ascii=False)
    # It may come from elsewhere, and must not steer the terminal.
    return text if text.isprintable() else json.dumps(value)
