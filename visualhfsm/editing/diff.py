"""Compare two versions of a document, element by element."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import fields
from enum import StrEnum
from typing import Any, Final, TypeVar

import msgspec

from codegen.hfsm.document import Argument, Automaton, Document, Node, State, Text, Transition

from .places import Place

__all__ = [
    "KEYS",
    "Difference",
    "DifferenceKind",
    "compared_fields",
    "diff_documents",
    "keyed",
    "part_of",
    "place_of",
    "shown",
]

_NodeT = TypeVar("_NodeT", bound=Node)

KEYS: Final[dict[str, Callable[[Any], Hashable]]] = {
    "automata": lambda automaton: automaton.id,
    "states": lambda state: state.id,
    "transitions": lambda transition: transition.id,
    "parameters": lambda parameter: parameter.name,
    "inputs": lambda parameter: parameter.name,
    "events": lambda event: event.name,
    "properties": lambda item: item.name,
    "libraries": lambda library: library.name.text,
    "interfaces": lambda interface: interface.name,
    "arguments": lambda argument: (argument.name, argument.child),
}
"""The key by which elements are matched, for each field that holds some."""

_PARTS: Final[dict[tuple[type[Node], str], str]] = {
    (Document, "on_error"): "onError",
    (Document, "on_refused"): "onRefused",
    (Automaton, "iteration_time"): "period",
    (Automaton, "imported"): "import",
    (Transition, "code"): "fired",
}
_POSITION: Final = frozenset(("x", "y"))
_UNSEEN: Final = frozenset(("attributes", "comments", "extras", "lists", "root_tag"))


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

    Automata, states and transitions are matched by their ids, other things by their names.
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


def keyed(name: str, items: Sequence[_NodeT]) -> dict[Hashable, _NodeT]:
    """Return the elements of a field by their keys; equal keys are numbered."""
    seen: Counter[Hashable] = Counter()
    found: dict[Hashable, _NodeT] = {}
    for item in items:
        key = KEYS[name](item)
        found[key, seen[key]] = item
        seen[key] += 1
    return found


def compared_fields(node: Node) -> list[str]:
    """Return the names of the fields of an element that say something."""
    return [each.name for each in fields(node) if each.compare]


def place_of(parent: Place, name: str, item: Node, index: int) -> Place:
    """Return the place of an element of the field `name` of what is at `parent`."""
    match item:
        case Automaton():
            return Place(kind="automaton", automaton=item.id)
        case State():
            return Place(kind="state", automaton=parent.automaton, id=item.id)
        case Transition():
            return Place(kind="transition", automaton=parent.automaton, id=item.id)
        case Argument():
            return Place(
                kind="state",
                automaton=parent.automaton,
                id=parent.id,
                part="argument",
                name=item.name,
                child=item.child,
            )
    return Place(kind=parent.kind, automaton=parent.automaton, part=name, index=index)


def part_of(node: Node, name: str) -> str:
    """Return what a field of an element is called in a place."""
    return _PARTS.get((type(node), name), name)


def shown(value: object) -> str:
    """Return a value of a field as a person may read it."""
    match value:
        case None:
            return ""
        case str():
            return value
        case Text():
            return value.text
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:g}"
        case tuple():
            return ", ".join(shown(each) for each in value)
        case State() | Transition():
            return value.name
        case Node():
            return ""
    return str(value)
