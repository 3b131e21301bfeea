"""The titles of documents that have no file yet."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Final

from codegen.hfsm.code.names import component_name

_LONGEST_BEGINNING: Final = 18  # characters before a number, as a component's name has 100 at most, in ASCII
_LONGEST_STEM: Final = 100


def stem(name: str) -> str:
    """Return the title for the name of a file: without its folder and its suffix."""
    return Path(name).stem[:_LONGEST_STEM] or "component"


def free_title(wanted: str, taken: Collection[str]) -> str:
    """Return a title, `untitled 2`, whose component is none of those that are taken."""
    titles = [wanted, *(f"{wanted[:_LONGEST_BEGINNING]} {number}" for number in range(2, len(taken) + 3))]
    return next(title for title in titles if component_name(title) not in taken)
