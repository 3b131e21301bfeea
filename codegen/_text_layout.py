"""Find the places of a file from those in its texts, in which entities and the like are decoded.

The place of a character in a text counts decoded characters from the first one, whose place in the file is
known: `&lt;` is one column wide, and a CDATA section has no brackets.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from typing import NamedTuple


class Place(NamedTuple):
    """A line and a column, from 1."""

    line: int
    column: int


class Mark(NamedTuple):
    """A place in a text, and its place in the file; up to the next mark both advance together."""

    in_text: Place
    in_file: Place


class TextLayout:
    """The texts of one file that are written otherwise than they are read; each has its marks in order.

    The last mark of a text is its end.
    """

    def __init__(self, texts: Iterable[list[Mark]]) -> None:
        self._texts = sorted(texts)
        self._starts = [marks[0].in_text for marks in self._texts]

    def in_file(self, place: Place) -> Place:
        """Return the place in the file of a place in a text; others are returned as they are."""
        index = bisect_right(self._starts, place) - 1
        if index < 0 or place > self._texts[index][-1].in_text:
            return place
        marks = self._texts[index]
        mark = marks[bisect_right(marks, place, key=lambda each: each.in_text) - 1]
        if mark.in_text.line != place.line:
            return place
        return Place(mark.in_file.line, mark.in_file.column + place.column - mark.in_text.column)
