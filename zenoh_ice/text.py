"""Text that came from others, made fit to be shown."""

from __future__ import annotations

import re
from typing import Final

__all__ = ["LONGEST_TEXT", "cut", "encodable", "printable", "without_source"]

LONGEST_TEXT: Final = 4096  # characters of the text of an error

_ELLIPSIS: Final = "..."
_SOURCE_PLACE: Final = re.compile(r" at /\S+\.rs:\d+\.?")


def cut(text: str, longest: int = LONGEST_TEXT) -> str:
    """Return a text with at most `longest` characters."""
    return text if len(text) <= longest else text[: longest - len(_ELLIPSIS)] + _ELLIPSIS


def encodable(text: str) -> str:
    """Return a text that UTF-8 can hold: half a surrogate pair, as in names of files, becomes its escape."""
    return text.encode("utf-8", "backslashreplace").decode()


def printable(text: str, longest: int = LONGEST_TEXT) -> str:
    """Return a text on one line, cut, and without what would steer a terminal or forge a line of a log."""
    short = cut(text, longest)
    return short if short.isprintable() else "".join(c if c.isprintable() else " " for c in short)


def without_source(error: Exception) -> str:
    """Return the text of an error of Zenoh's without the places in its sources, which tell a user nothing."""
    return _SOURCE_PLACE.sub("", str(error))
