"""Write a guessed description of a robot as TOML, each guess with its reason beside it as a comment."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any, Final

_WIDTH: Final = 110
_ROWS: Final = textwrap.TextWrapper(
    _WIDTH, initial_indent="  ", subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
)
_BARE: Final = re.compile(r"[A-Za-z0-9_-]+")
_INLINE: Final = ("joint", "hinges")
"""Tables whose entries are a line each."""


def toml_text(document: Mapping[str, Any], reasons: Mapping[tuple[str | int, ...], str], head: str) -> str:
    """Return a document as TOML that begins with `head` as a comment; `reasons` are those of its entries."""
    return "\n".join([*_comment(head), "", *_lines(document, reasons, ()), ""])


def torques_to_paste(torques: Mapping[str, float]) -> str:
    """Return the largest torques of some joints as TOML."""
    return "\n".join(
        ["[joint]", *(f"{key(name)} = {{ max_torque = {value:g} }}" for name, value in torques.items())]
    )


def key(name: str) -> str:
    """Return a key as TOML wants it: in quotes if it has other signs than letters, digits, - and _."""
    return name if _BARE.fullmatch(name) else value_text(name)


def value_text(value: object) -> str:
    """Return a value as TOML, in one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key(name)} = {value_text(item)}" for name, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(value_text(item) for item in value) + "]"
    # JSON writes texts as TOML reads them, except for DEL, which TOML wants to be escaped.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _lines(
    table: Mapping[str, Any], reasons: Mapping[tuple[str | int, ...], str], path: tuple[str | int, ...]
) -> Iterator[str]:
    """Yield the lines of a table: first its plain values, then its tables."""
    tables = {name: item for name, item in table.items() if _is_table(item, path)}
    for name, item in table.items():
        if name not in tables:
            yield from _entry(name, item, _why(reasons, (*path, name), item))
    for name, item in tables.items():
        at = (*path, name)
        header = ".".join(key(str(each)) for each in at if not isinstance(each, int))
        for number, each in enumerate(item if isinstance(item, list) else [item]):
            inner = (*at, number) if isinstance(item, list) else at
            nested = not isinstance(item, list) and all(_is_table(value, inner) for value in each.values())
            if not nested:
                yield ""
                yield from _comment(reasons.get(inner, ""))
                yield f"[[{header}]]" if isinstance(item, list) else f"[{header}]"
            yield from _lines(each, reasons, inner)


def _is_table(item: object, path: tuple[str | int, ...]) -> bool:
    """Return whether a value gets a header."""
    if path[:1] in [(name,) for name in _INLINE]:
        return False
    if isinstance(item, list):
        return bool(item) and all(isinstance(each, Mapping) for each in item)
    return isinstance(item, Mapping)


def _entry(name: str, value: object, why: str) -> Iterator[str]:
    """Yield the lines of a value, with the reason behind it if there is room, else before it."""
    line = f"{key(name)} = {value_text(value)}"
    if why and len(line) + len(why) + 4 > _WIDTH:
        yield from _comment(why)
        why = ""
    if len(line) > _WIDTH and isinstance(value, (list, tuple)):
        items = ", ".join(value_text(item).replace(" ", "\0") for item in value)  # each in one row
        line = "\n".join((f"{key(name)} = [", *_ROWS.wrap(items), "]")).replace("\0", " ")
    yield f"{line}  # {why}" if why else line


def _why(reasons: Mapping[tuple[str | int, ...], str], path: tuple[str | int, ...], value: object) -> str:
    """Return the reason of an entry, and of those within it."""
    inner = [(*path, name) for name in value] if isinstance(value, Mapping) else []
    found = dict.fromkeys(reasons[at] for at in (path, *inner) if at in reasons)
    return "; ".join(found)


def _comment(text: str) -> Iterator[str]:
    """Yield the lines of a comment: each line of the text as a paragraph, indented as it is."""
    for line in text.splitlines():
        indent = "# " + " " * (len(line) - len(line.lstrip()))
        yield from textwrap.wrap(line.strip(), _WIDTH, initial_indent=indent, subsequent_indent="# ") or ["#"]
