"""What the parts of a document are told by when two versions of it are compared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from dataclasses import fields
from typing import Any, Final, TypeVar

from codegen.hfsm.document import (
    Argument,
    Automaton,
    Document,
    Node,
    State,
    Text,
    Transition,
)

from .places import Place

__all__ = ["KEYS", "compared_fields", "keyed", "part_of", "place_of", "shown"]

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
"""For each field that holds elements by what they are told apart."""

_PARTS: Final[dict[tuple[type[Node], str], str]] = {
    (Document, "on_error"): "onError",
    (Document, "on_refused"): "onRefused",
    (Automaton, "iteration_time"): "period",
    (Automaton, "imported"): "import",
    (Transition, "code"): "fired",
}


def keyed(name: str, items: Sequence[_NodeT]) -> dict[Hashable, _NodeT]:
    """Return the elements of a field by their keys; of several with one key each has one of its own."""
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
