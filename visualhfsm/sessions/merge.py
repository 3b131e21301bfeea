"""Merge two versions of a document with a common ancestor.

What only one side changed is taken from it; texts, such as code, are merged line by line. Where both changed
the same part of an element, mine is kept, and the element is a conflict. New elements of theirs with the id
of a new one of mine get another id. Inconsistencies, such as a transition to a state that the other side
deleted, are left to the checks.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import replace
from difflib import SequenceMatcher
from typing import Any, Final, NamedTuple, TypeVar

from codegen.hfsm.document import Automaton, Document, Node, State, Text, Transition
from visualhfsm.editing.diff import KEYS, compared_fields, keyed, part_of, shown
from visualhfsm.editing.nodes import free_ids, label

__all__ = ["Merged", "merge_documents", "merge_lines"]

_NodeT = TypeVar("_NodeT", bound=Node)
_T = TypeVar("_T", bound=Hashable)

_MOST_LINES: Final = 5000
"""Limit of the lines of a text that is compared line by line."""


class Merged(NamedTuple):
    """The result of a merge; `conflicts` names the elements of which both changed the same."""

    document: Document
    conflicts: tuple[str, ...]


def merge_documents(base: Document, mine: Document, theirs: Document) -> Merged:
    """Return the merge of `mine` and `theirs` with their common ancestor `base`."""
    conflicts: list[str] = []
    document = _merged_node(base, mine, _with_own_numbers(base, mine, theirs), conflicts)
    return Merged(document, tuple(conflicts))


def _merged_node(base: _NodeT, mine: _NodeT, theirs: _NodeT, conflicts: list[str]) -> _NodeT:
    values: dict[str, Any] = {}
    parts: list[str] = []
    for name in compared_fields(mine):
        old, own, other = (getattr(each, name) for each in (base, mine, theirs))
        if other == own or other == old:  # noqa: PLR1714, SIM109 - not everything has a hash
            continue
        if own == old:
            values[name] = other
        elif name in KEYS:
            values[name] = _merged_list(name, old, own, other, conflicts)
        elif isinstance(own, tuple):
            values[name] = _merged_sequence(old, own, other)
        elif isinstance(own, Text) and (text := merge_lines(old.text, own.text, other.text)) is not None:
            values[name] = Text(text)
        elif name not in ("x", "y"):  # positions are no conflict
            parts.append(part_of(mine, name))
    if parts:
        conflicts.append(f"{_what(mine)} ({', '.join(parts)}): yours stays")
    merged: _NodeT = replace(mine, **values) if values else mine
    return merged


def _merged_list(
    name: str, base: Sequence[Node], mine: Sequence[Node], theirs: Sequence[Node], conflicts: list[str]
) -> tuple[Node, ...]:
    old, here, there = keyed(name, base), keyed(name, mine), keyed(name, theirs)
    found: dict[Hashable, Node] = {}
    for key in {**here, **there}:
        former, own, other = old.get(key), here.get(key), there.get(key)
        if own is not None and other is not None:
            found[key] = own if former is None else _merged_node(former, own, other, conflicts)
            if former is None and own != other:
                conflicts.append(f"{_what(own)} (new on both sides): yours stays")
        elif (kept := own or other) is not None and kept != former:
            found[key] = kept
            if former is not None:
                conflicts.append(f"{_what(kept)} (deleted on one side): it stays")
    order = _merged_sequence(tuple(old), tuple(here), tuple(there), keep=set(found))
    return tuple(found[key] for key in order)


def _what(node: Node) -> str:
    match node:
        case Document():
            return "the document"
        case Automaton():
            return f"automaton {node.id}"
        case State() | Transition():
            return f"{type(node).__name__.lower()} {label(node)}"
    return f"{type(node).__name__.lower()} {shown(node)}"


def _merged_sequence(
    base: Sequence[_T], mine: Sequence[_T], theirs: Sequence[_T], keep: Iterable[_T] | None = None
) -> tuple[_T, ...]:
    """Return the items of two sequences in the order of the side that changed it, mine if both did.

    Those that one side removed are left out unless they are to be kept.
    """
    old, here, there = set(base), set(mine), set(theirs)
    kept = set(keep) if keep is not None else (here & there) | ((here | there) - old)
    common = here & there & old
    same_order = [item for item in mine if item in common] == [item for item in base if item in common]
    spine, other = (theirs, mine) if same_order else (mine, theirs)
    order, present = list(dict.fromkeys(spine)), set(spine)
    for before, item in zip((None, *other), other, strict=False):
        if item not in present:
            order.insert(0 if before is None else order.index(before) + 1, item)
    return tuple(item for item in dict.fromkeys(order) if item in kept)


def _with_own_numbers(base: Document, mine: Document, theirs: Document) -> Document:
    """Return their version with other ids for what is new in it and collides with what is new in mine."""
    old = {automaton.id: automaton for automaton in base.automata}
    here = {automaton.id: automaton for automaton in mine.automata}
    numbers = _new_numbers(base.automata, mine.automata, theirs.automata)
    automata = (
        _with_own_items(old[each.id], here[each.id], each) if each.id in old and each.id in here else each
        for each in theirs.automata
    )
    if numbers:
        automata = (
            replace(
                each,
                id=numbers.get(each.id, each.id),
                father=numbers.get(each.father, each.father),
                states=tuple(_with_children(state, numbers) for state in each.states),
            )
            for each in automata
        )
    return replace(theirs, automata=tuple(automata))


def _with_children(state: State, numbers: dict[int, int]) -> State:
    return replace(
        state,
        children=tuple(numbers.get(child, child) for child in state.children),
        arguments=tuple(replace(each, child=numbers.get(each.child, each.child)) for each in state.arguments),
    )


def _with_own_items(base: Automaton, mine: Automaton, theirs: Automaton) -> Automaton:
    states = _new_numbers(base.states, mine.states, theirs.states)
    transitions = tuple(
        replace(
            each,
            origin=states.get(each.origin, each.origin),
            destination=states.get(each.destination, each.destination),
        )
        for each in theirs.transitions
    )
    numbers = _new_numbers(base.transitions, mine.transitions, transitions)
    return replace(
        theirs,
        states=tuple(replace(each, id=states.get(each.id, each.id)) for each in theirs.states),
        transitions=tuple(replace(each, id=numbers.get(each.id, each.id)) for each in transitions),
    )


def _new_numbers(
    base: Sequence[Automaton | State | Transition],
    mine: Sequence[Automaton | State | Transition],
    theirs: Sequence[Automaton | State | Transition],
) -> dict[int, int]:
    """Return other ids for what is new in theirs and has that of something else that is new in mine."""
    old = {each.id for each in base}
    here = {each.id: each for each in mine}
    free = free_ids((*old, *here, *(each.id for each in theirs)))
    return {
        each.id: next(free)
        for each in theirs
        if each.id not in old and each.id in here and here[each.id] != each
    }


class _Hunk(NamedTuple):
    """Lines of the base, from `start` up to but not with `end`, and what one side has in their place."""

    start: int
    end: int
    lines: list[str]


def merge_lines(base: str, mine: str, theirs: str) -> str | None:
    """Return the merge of two texts with the ancestor `base`, or None when both changed the same.

    Changes of adjacent lines count as the same: together they might mean something that neither side has
    written.
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
    """Return a text whose last line ends with a newline, so that it compares equal when another follows."""
    return text if text.endswith("\n") else f"{text}\n"


def _ends(base: str, mine: str, theirs: str) -> bool:
    """Return whether the merged text ends with a newline, as on the side that changed that."""
    own, other = mine.endswith("\n"), theirs.endswith("\n")
    return own if own != base.endswith("\n") else other
