"""What the rules about Python 2 find, and how it is mended."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from .words import Word

__all__ = ["Edit", "Match", "Rule"]


@dataclass(frozen=True, slots=True)
class Edit:
    """Text to put in the place of what stands from `start` to `end`."""

    start: int
    end: int
    text: str


@dataclass(frozen=True, slots=True)
class Match:
    """A place where a rule found something; without edits it has to be mended by hand."""

    start: int
    message: str
    edits: tuple[Edit, ...] = ()


Rule = Callable[[str, Sequence[Word]], Iterator[Match]]
"""Looks at code and its words."""
