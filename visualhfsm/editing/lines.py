"""Bring together two versions of a text, line by line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher
from typing import NamedTuple

__all__ = ["merge_lines"]

_MOST_LINES = 5000
"""Lines of a text that is compared line by line; nobody types more."""


class _Hunk(NamedTuple):
    """Lines of the base, from `start` up to but not with `end`, and what one side has in their place."""

    start: int
    end: int
    lines: list[str]


def merge_lines(base: str, mine: str, theirs: str) -> str | None:
    """Return what two texts make together that both began as `base`, or None when they changed the same.

    Changes that touch, such as of two lines that follow each other, are taken to be of the same: together
    they might mean something that neither side has written.
    """
    lines, *others = (text.splitlines(keepends=True) for text in (_ended(base), _ended(mine), _ended(theirs)))
    if max(len(lines), *map(len, others)) > _MOST_LINES:
        return None
    here, there = (list(_hunks(lines, other)) for other in others)
    merged: list[str] = []
    done = 0
    while here or there:
        if here and there and here[0] == there[0]:
            hunk = here.pop(0)
            there.pop(0)
        else:
            turn, other = (here, there) if not there or (here and here[0] < there[0]) else (there, here)
            hunk = turn.pop(0)
            if other and other[0].start <= hunk.end:
                return None
        merged += lines[done : hunk.start]
        merged += hunk.lines
        done = hunk.end
    text = "".join(merged + lines[done:])
    return text if _ends(base, mine, theirs) else text.removesuffix("\n")


def _hunks(base: Sequence[str], changed: Sequence[str]) -> Iterator[_Hunk]:
    matcher = SequenceMatcher(None, base, changed, autojunk=False)
    for what, start, end, first, last in matcher.get_opcodes():
        if what != "equal":
            yield _Hunk(start, end, list(changed[first:last]))


def _ended(text: str) -> str:
    """Return a text whose last line ends as all others, so that it is the same when another follows."""
    return text if text.endswith("\n") else f"{text}\n"


def _ends(base: str, mine: str, theirs: str) -> bool:
    """Return whether the merged text ends with a line's end: as the side that changed that has it."""
    own, other = mine.endswith("\n"), theirs.endswith("\n")
    return own if own != base.endswith("\n") else other
