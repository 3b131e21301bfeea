"""Take what a client of libqi sent for what it must be; every value of it is foreign."""

from __future__ import annotations

import math
from typing import Final

from naoserver.errors import InvalidCommand

__all__ = ["fraction", "keepable", "listed", "number", "number_lists", "numbers", "text", "texts"]

MOST: Final = 1000
"""Entries that a list may have."""
LONGEST: Final = 10_000
"""Characters that a text may have."""
_TOLD: Final = 60  # characters of a foreign value that are told back


def number(value: object, what: str) -> float:
    """Return a finite number. Raises InvalidCommand."""
    if not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InvalidCommand(what, f"{what} is {_told(value)}, not a finite number")
    return float(value)


def fraction(value: object, what: str) -> float:
    """Return a number above 0 and at most 1. Raises InvalidCommand."""
    result = number(value, what)
    if not 0.0 < result <= 1.0:
        raise InvalidCommand(what, f"{what} is {result:g}: it must be above 0 and at most 1")
    return result


def listed(value: object, what: str) -> list[object]:
    """Return the entries of a list. Raises InvalidCommand."""
    if not isinstance(value, (list, tuple)):
        raise InvalidCommand(what, f"{what} is {_told(value)}, not a list")
    if len(value) > MOST:
        raise InvalidCommand(what, f"{what} has {len(value)} entries, more than {MOST}")
    return list(value)


def numbers(value: object, what: str, count: int) -> list[float]:
    """Return `count` numbers: those of a list, or one for all. Raises InvalidCommand."""
    if not isinstance(value, (list, tuple)):
        return [number(value, what)] * count
    if len(value) != count:
        raise InvalidCommand(what, f"{what} has {len(value)} entries for {count} joints")
    return [number(entry, what) for entry in value]


def number_lists(value: object, what: str, count: int) -> list[list[float]]:
    """Return a list of numbers for each of `count` joints. Raises InvalidCommand.

    As NAOqi does, it takes one number for all; a number or a list for each; of one joint also its list alone.
    """
    if not isinstance(value, (list, tuple)):
        return [[number(value, what)] for _ in range(count)]
    entries = listed(value, what)
    if count == 1 and not any(isinstance(entry, (list, tuple)) for entry in entries):
        entries = [entries]
    if len(entries) != count:
        raise InvalidCommand(what, f"{what} has {len(entries)} entries for {count} joints")
    return [
        [number(one, what) for one in (listed(entry, what) if isinstance(entry, (list, tuple)) else [entry])]
        for entry in entries
    ]


def text(value: object, what: str) -> str:
    """Return a text. Raises InvalidCommand."""
    if not isinstance(value, str):
        raise InvalidCommand(what, f"{what} is {_told(value)}, not a text")
    if len(value) > LONGEST:
        raise InvalidCommand(what, f"{what} has {len(value)} characters, more than {LONGEST}")
    return value


def texts(value: object, what: str) -> list[str]:
    """Return one text or the texts of a list. Raises InvalidCommand."""
    if isinstance(value, str):
        return [text(value, what)]
    return [text(entry, what) for entry in listed(value, what)]


def keepable(value: object, what: str) -> object:
    """Return a value that may be kept: nothing, a number, a text, or lists of these that are not too large.

    Raises InvalidCommand.
    """
    size, rest = 0, [value]
    while rest:
        part = rest.pop()
        if isinstance(part, (str, bytes, bytearray)):
            size += len(part)
        elif isinstance(part, (list, tuple)):
            size += len(part)
            rest.extend(part[:LONGEST])
        elif isinstance(part, dict):
            size += len(part)
            rest.extend(list(part.items())[:LONGEST])
        elif part is not None and not isinstance(part, (int, float)):
            raise InvalidCommand(what, f"{what} holds a {type(part).__name__}: only plain values are kept")
        if size > LONGEST:
            raise InvalidCommand(what, f"{what} is too large: {LONGEST} characters and entries are kept")
    return value


def _told(value: object) -> str:
    whole = repr(value)
    return whole if len(whole) <= _TOLD else f"{whole[:_TOLD]}..."
