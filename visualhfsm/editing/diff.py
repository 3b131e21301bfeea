"""Tell two versions of a document apart, thing by thing."""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from typing import Final

import msgspec

from codegen.hfsm.document import Document, Node, Text

from .comparison import KEYS, compared_fields, keyed, part_of, place_of, shown
from .places import Place

__all__ = ["Difference", "DifferenceKind", "diff_documents"]

_POSITION: Final = frozenset(("x", "y"))
_UNSEEN: Final = frozenset(
    ("attributes", "comments", "config_extras", "extras", "leaves", "libraries_extras", "root_tag")
)


class DifferenceKind(StrEnum):
    """In which way two versions differ."""

    ADDED = "added"
    REMOVED = "removed"
    CHANGED = "changed"
    MOVED = "moved"


class Difference(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """One thing that differs: a whole one, or the `part` of one, with its text before and after.

    What is unknown to the editor is the part `other`.
    """

    kind: DifferenceKind
    place: Place
    part: str = ""
    before: str = ""
    after: str = ""


def diff_documents(before: Document, after: Document) -> list[Difference]:
    """Return what differs between two versions, in the order of the later one, which is `after`.

    Automata, states and transitions are told by their ids, other things by their names.
    """
    return list(_nodes(before, after, Place(kind="document")))


def _nodes(before: Node, after: Node, place: Place) -> Iterator[Difference]:
    if before == after:
        return
    moved = other = False
    for name in compared_fields(after):
        old, new = getattr(before, name), getattr(after, name)
        if old is new or old == new:
            continue
        if name in KEYS:
            yield from _lists(name, old, new, place)
        elif name in _POSITION:
            moved = True
        elif name in _UNSEEN:
            other = True
        else:
            part = part_of(after, name)
            yield Difference(
                kind=DifferenceKind.CHANGED, place=place, part=part, before=_text(old), after=_text(new)
            )
    if moved:
        yield Difference(
            kind=DifferenceKind.MOVED, place=place, before=_position(before), after=_position(after)
        )
    if other:
        yield Difference(kind=DifferenceKind.CHANGED, place=place, part="other")


def _lists(
    name: str, before: tuple[Node, ...], after: tuple[Node, ...], place: Place
) -> Iterator[Difference]:
    old, new = keyed(name, before), keyed(name, after)
    for index, (key, item) in enumerate(new.items()):
        at = place_of(place, name, item, index)
        former = old.get(key)
        if former is None:
            yield Difference(kind=DifferenceKind.ADDED, place=at, after=_name(item))
        else:
            yield from _nodes(former, item, at)
    for index, (key, item) in enumerate(old.items()):
        if key not in new:
            yield Difference(
                kind=DifferenceKind.REMOVED, place=place_of(place, name, item, index), before=_name(item)
            )
    common_old = [key for key in old if key in new]
    common_new = [key for key in new if key in old]
    if common_old != common_new:
        yield Difference(kind=DifferenceKind.CHANGED, place=place, part=f"{name} order")


def _text(value: object) -> str:
    file = getattr(value, "file", None)
    return shown(file if isinstance(file, Text) else value)


def _name(item: Node) -> str:
    return shown(getattr(item, "name", ""))


def _position(node: Node) -> str:
    return f"{shown(getattr(node, 'x', 0.0))}, {shown(getattr(node, 'y', 0.0))}"
