"""What Python 3 does not take for a word: operators, numbers, strings, and tabs among spaces."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Sequence

from ..trees import parse_python
from .matches import Edit, Match
from .words import Word

__all__ = ["backquotes", "numbers", "operators", "strings", "tabs"]


def backquotes(_code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find what backquotes make a text of."""
    quotes = [word for word in words if word.text == "`"]
    for opening, closing in zip(quotes[::2], quotes[1::2], strict=False):
        edits = (Edit(opening.start, opening.end, "repr("), Edit(closing.start, closing.end, ")"))
        yield Match(opening.start, "`` `x` `` is `repr(x)` in Python 3", edits)


def operators(_code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find `<>`."""
    for word in words:
        if word.text == "<>":
            edits = (Edit(word.start, word.end, "!="),)
            yield Match(word.start, "`<>` is `!=` in Python 3", edits)


def numbers(_code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find octal numbers that begin with 0 alone, and long ones."""
    for word in words:
        if word.kind != "number":
            continue
        digits = word.text.rstrip("lL")
        if re.fullmatch(r"0\d*[1-9]\d*", digits):
            if not set(digits) <= set("01234567"):
                continue
            digits = f"0o{digits[1:]}"
        if digits != word.text:
            message = f"the number `{word.text}` is `{digits}` in Python 3"
            yield Match(word.start, message, (Edit(word.start, word.end, digits),))


def strings(_code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find strings that begin with `ur`."""
    for word in words:
        prefix = word.text[: len(word.text) - len(word.text.lstrip("uUbBrRfF"))]
        if word.kind != "string" or prefix.lower() != "ur":
            continue
        message = "a string cannot begin with `ur` in Python 3"
        edits = (Edit(word.start, word.start + 1, ""),)
        # Only Python 2 puts characters in the place of escapes there.
        yield Match(word.start, message, () if re.search(r"\\[uU]", word.text) else edits)


def tabs(code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Tell of tabs that stand for eight columns, as Python 2 had it, where Python 3 sees no order."""
    if "\t" not in code or not _mixes_tabs(code):
        return
    for word, before in zip(words, [Word("newline", "", 0), *words], strict=False):
        if before.kind != "newline" or word.kind in ("newline", "end"):
            continue
        start = code.rfind("\n", 0, word.start) + 1
        margin = code[start : word.start]
        if "\t" in margin and not margin.strip():
            edits = (Edit(start, word.start, margin.expandtabs(8)),)
            yield Match(start, "tabs and spaces are mixed in the indentation", edits)


def _mixes_tabs(code: str) -> bool:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            parse_python(code.strip("\r\n"))
    except TabError:
        return True
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return False
