"""Search the names and all code of a document."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from typing import Final

import msgspec

from codegen.hfsm.document import Document

from .places import Place, spots

__all__ = ["Hit", "search"]

_MOST_HITS: Final = 1000
_LONGEST_EXCERPT: Final = 160


class Hit(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """Where a text was found: line and column in the text at the place, from 1, and that line of it."""

    place: Place
    line: int
    column: int
    length: int
    excerpt: str


def search(
    document: Document, text: str, *, match_case: bool = False, whole_words: bool = False
) -> list[Hit]:
    """Return where a text stands in names, code and whatever else a person typed; the first 1000 places."""
    if not text:
        return []
    pattern = re.escape(text)
    if whole_words:
        pattern = rf"(?<!\w){pattern}(?!\w)"
    return list(islice(_hits(document, re.compile(pattern, 0 if match_case else re.IGNORECASE)), _MOST_HITS))


def _hits(document: Document, pattern: re.Pattern[str]) -> Iterator[Hit]:
    for place, text, _, _ in spots(document):
        for found in pattern.finditer(text or ""):
            assert text is not None
            start = text.rfind("\n", 0, found.start()) + 1
            end = text.find("\n", found.start())
            line = text[start : end if end >= 0 else len(text)]
            yield Hit(
                place=place,
                line=text.count("\n", 0, found.start()) + 1,
                column=found.start() - start + 1,
                length=found.end() - found.start(),
                excerpt=_excerpt(line, found.start() - start),
            )


def _excerpt(line: str, at: int) -> str:
    first = max(0, at - _LONGEST_EXCERPT // 2) if len(line) > _LONGEST_EXCERPT else 0
    return line[first : first + _LONGEST_EXCERPT].strip()
