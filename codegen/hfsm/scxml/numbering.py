"""Give the parts of a document their ids, and their places where SCXML has another order."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from itertools import count

from ..formats.dialects.elements import MAX_ID
from ..formats.xml_tree import XmlComment, XmlElement
from .chart import ChartAutomaton, ChartState

__all__ = ["Placed", "give_ids", "id_of", "in_order"]

Placed = tuple[int | None, list[XmlComment], XmlElement]
"""An element with the place that it tells, if it does, and the comments before it."""


def id_of(native: XmlElement | None) -> int | None:
    """Return the id that a native element has, or None."""
    text = native.attributes.get("id", "").strip() if native is not None else ""
    is_id = text.isascii() and text.isdigit() and len(text) <= 10 and int(text) <= MAX_ID
    return int(text) if is_id else None


def give_ids(
    items: Iterable[ChartAutomaton | ChartState],
    taken: Collection[int | None],
    used: Collection[ChartAutomaton | ChartState],
) -> None:
    """Give all a number: their own if they tell one, but not twice to those that are `used` by others."""
    numbers: set[int | None] = set()
    without = []
    for item in items:
        number = id_of(item.native)
        if number is None or (number in numbers and item in used):
            without.append(item)
        else:
            item.number = number
            numbers.add(number)
    free = (number for number in count(1) if number not in numbers and number not in taken)
    for item in without:
        item.number = next(free)


def in_order(
    items: Iterable[Placed],
) -> list[tuple[list[XmlComment], XmlElement]]:
    """Return elements by the places that they tell; one that tells none stays behind the one before it."""
    placed: list[tuple[int, list[XmlComment], XmlElement]] = []
    last = -1
    for index, comments, element in items:
        last = index if index is not None else last
        placed.append((last, comments, element))
    placed.sort(key=lambda item: item[0])
    return [(comments, element) for _, comments, element in placed]
