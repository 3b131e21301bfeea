"""Write results: pretty and in color for a person at a terminal, plain otherwise, as JSON for a program."""

from __future__ import annotations

import json
import math
import shutil
import sys
import textwrap
import time
from typing import Final

import typer
from rich.console import Console
from rich.highlighter import JSONHighlighter
from rich.text import Text

from nao_tools._values import Json
from zenoh_ice.data.text import printable

_ANY_LENGTH: Final = 1 << 16  # columns
_INDENT: Final = 2
_MOST_ITEMS: Final = 32  # of a list that are shown to a person; a few more, if those are all
_FEW: Final = 8
_DIGITS: Final = 6  # significant ones, of a number that is shown to a person
_LONGEST_TEXT: Final = 2000
_LONGEST_REASON: Final = 300
_DAY: Final = 86400.0  # s
_LONGEST_LOSS: Final = 1e4 * _DAY
_DURATIONS: Final = (("us", 1e6), ("ms", 1e3), ("s", 1))


def for_people() -> bool:
    """Return whether standard output is a terminal."""
    return sys.stdout.isatty()


def width() -> int:
    """Return the number of columns of the output."""
    return shutil.get_terminal_size((100, 24)).columns


def console() -> Console:
    """Return a console for tables and colors; without a terminal, no colors, and lines of any length."""
    return Console(highlight=False, width=None if for_people() else _ANY_LENGTH)


def wrapped(text: str, indent: int) -> Text:
    """Return a text that is wrapped for a terminal, with its further lines indented."""
    if for_people():
        margin = " " * indent
        text = textwrap.fill(
            text, width(), subsequent_indent=margin, break_long_words=False, break_on_hyphens=False
        )
    return Text(text)


def print_json(value: Json) -> None:
    """Print a value as JSON on one line."""
    typer.echo(json.dumps(value, ensure_ascii=False, allow_nan=False))


def print_value(value: Json) -> None:
    """Print a value so that a person can read it."""
    if for_people():
        console().print(JSONHighlighter()(pretty(value, width())), soft_wrap=True)
    else:
        typer.echo(pretty(value, width(), whole=True))


def pretty(value: Json, columns: int, *, whole: bool = False) -> str:
    """Return a value as JSON; every part that fits on a line is on one line.

    Unless it is to be `whole`, long lists and texts are cut, and numbers rounded.
    """
    return _layout(value if whole else _cut(value), columns, 0, 0)


def _cut(value: Json) -> Json:
    match value:
        case dict():
            return {key: _cut(item) for key, item in value.items()}
        case list():
            shown = len(value) if len(value) <= _MOST_ITEMS + _FEW else _MOST_ITEMS
            more = [f"... {len(value) - shown} more"] if shown < len(value) else []
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
    lines: list[str] = []
    if isinstance(value, dict):
        for key, item in value.items():
            head = f"{margin}{_flat(key)}: "
            lines.append(head + _layout(item, columns - 1, indent + _INDENT, len(head)))
    else:
        filling = not any(isinstance(item, dict | list) for item in value)
        for item in value:
            text = _layout(item, columns - 1, indent + _INDENT, len(margin))
            if filling and lines and len(lines[-1]) + len(text) + 3 <= columns:
                lines[-1] += f", {text}"
            else:
                lines.append(margin + text)
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    body = ",\n".join(lines)
    return f"{opening}\n{body}\n{' ' * indent}{closing}"


def _flat(value: Json) -> str:
    text = json.dumps(value, ensure_ascii=False)
    # It may come from another program, and must not control the terminal.
    return text if text.isprintable() else json.dumps(value)


def span_text(seconds: float) -> str:
    """Return an elapsed time in its largest unit: `12 s`, `5 min`, `3 h`, `2 days`."""
    if not math.isfinite(seconds):
        return "-"
    for unit, length, limit in (("s", 1, 120), ("min", 60, 120 * 60), ("h", 3600, 48 * 3600)):
        if seconds < limit:
            return f"{max(0, int(seconds // length))} {unit}"
    return f"{int(seconds // 86400)} days"


def lost_text(why: str, seconds: float) -> str:
    """Return since when a robot is lost, and why: `lost since 11:07:03 (12 s): the link broke`."""
    why = printable(why, _LONGEST_REASON)
    if not 0.0 <= seconds < _LONGEST_LOSS:  # it may come from another program
        return f"lost: {why}"
    since = time.localtime(time.time() - seconds)
    form = "%H:%M:%S" if seconds < _DAY else "%Y-%m-%d %H:%M"
    return f"lost since {time.strftime(form, since)} ({span_text(seconds)}): {why}"


def duration_text(seconds: float) -> str:
    """Return a short duration with three digits: `85 us`, `1.23 ms`, `4.5 s`."""
    if not math.isfinite(seconds):
        return "-"
    unit, scale = next(each for each in _DURATIONS if abs(seconds) * each[1] < 1000 or each[1] == 1)
    return f"{_three_digits(seconds * scale)} {unit}"


def count_text(number: int, singular: str, plural: str = "") -> str:
    """Return a number of things: `1 servant`, `3 servants`."""
    return f"{number} {singular if number == 1 else plural or singular + 's'}"


def _three_digits(value: float) -> str:
    digits = 2
    if abs(value) >= 100:
        digits = 0
    elif abs(value) >= 10:
        digits = 1
    return f"{value:.{digits}f}"
