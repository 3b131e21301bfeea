"""Bring together two versions of a document that began as the same one.

What only one side changed is taken from it; of a text, such as a piece of code, it is line by line. Where
both changed the same, mine stays, and the conflict is reported. New things of theirs that happen to have the
number of a new one of mine get another.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from typing import Any, Final, NamedTuple, TypeVar

import msgspec

from codegen.hfsm.document import NO_CHILD, Automaton, Document, Node, State, Text, Transition
from visualhfsm.editing.diff import KEYS, compared_fields, keyed, part_of, place_of, shown
from visualhfsm.editing.nodes import changed, free_ids
from visualhfsm.editing.places import Place
from visualhfsm.editing.subtrees import owners

__all__ = ["Conflict", "Merged", "merge_documents", "merge_lines"]

_NodeT = TypeVar("_NodeT", bound=Node)
_T = TypeVar("_T", bound=Hashable)

_SEQUENCES: Final = frozenset(("children", "comments", "extras", "lists"))
_MOST_LINES: Final = 5000
"""Lines of a text that is compared line by line; nobody types more."""


class Conflict(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """What both sides changed: `message` says what became of it; the texts are empty where there are none."""

    place: Place
    message: str
    part: str = ""
    base: str = ""
    mine: str = ""
    theirs: str = ""


@dataclass(frozen=True, slots=True)
class Merged:
    """The outcome of a merge."""

    document: Document
    conflicts: tuple[Conflict, ...]


def merge_documents(base: Document, mine: Document, theirs: Document) -> Merged:
    """Return what `mine` and `theirs` make together, both of which began as `base`."""
    merger = _Merger()
    theirs = _with_own_numbers(base, mine, theirs)
    document = merger.nodes(base, mine, theirs, Place(kind="document"))
    document = merger.consistent(document, mine, theirs)
    return Merged(document, tuple(merger.conflicts))


class _Merger:
    def __init__(self) -> None:
        self.conflicts: list[Conflict] = []

    def nodes(self, base: _NodeT, mine: _NodeT, theirs: _NodeT, place: Place) -> _NodeT:
        """Return what two versions of an element make together."""
        if mine == theirs or theirs == base:  # noqa: PLR1714 - compared deeply, and cheapest first
            return mine
        if mine == base:
            return theirs
        values: dict[str, Any] = {}
        for name in compared_fields(mine):
            versions = tuple(getattr(each, name) for each in (base, mine, theirs))
            values[name] = self._field(mine, name, versions, place)
        texts = {name: value for name, value in values.items() if isinstance(value, Text | str)}
        others = {name: value for name, value in values.items() if name not in texts}
        merged: _NodeT = changed(
            replace(mine, **others),
            **{name: value.text if isinstance(value, Text) else value for name, value in texts.items()},
        )
        return merged

    def _field(self, node: Node, name: str, versions: tuple[Any, Any, Any], place: Place) -> Any:  # noqa: ANN401
        base, mine, theirs = versions
        if theirs == mine or theirs == base:  # noqa: PLR1714, SIM109 - not everything has a hash
            return mine
        if mine == base:
            return theirs
        if name in KEYS:
            return self._lists(name, base, mine, theirs, place)
        if name in _SEQUENCES:
            return _merged_sequence(base, mine, theirs)
        if name in ("x", "y", "attributes"):
            return mine  # nobody wants to be asked about pixels
        if isinstance(base, Text):
            text = merge_lines(base.text, mine.text, theirs.text)
            if text is not None:
                return Text(text)
        self.conflicts.append(
            Conflict(
                place=place,
                part=part_of(node, name),
                message="both changed it: mine stays",
                base=shown(base),
                mine=shown(mine),
                theirs=shown(theirs),
            )
        )
        return mine

    def _lists(
        self,
        name: str,
        base: Sequence[Node],
        mine: Sequence[Node],
        theirs: Sequence[Node],
        place: Place,
    ) -> tuple[Node, ...]:
        old, here, there = keyed(name, base), keyed(name, mine), keyed(name, theirs)
        found: dict[Hashable, Node] = {}
        for index, key in enumerate({**here, **there}):
            own, other, former = here.get(key), there.get(key), old.get(key)
            at = place_of(place, name, own or other or former or Node(), index)
            if own is not None and other is not None and former is not None:
                found[key] = self.nodes(former, own, other, at)
            elif own is not None and other is not None:
                found[key] = own
                if own != other:
                    self._report(at, "both added one of this name: mine stays", own)
            elif own is not None:
                if former is None or own != former:
                    found[key] = own
                if former is not None and own != former:
                    self._report(at, "changed here and deleted there: it stays", own)
            elif other is not None:
                if former is None or other != former:
                    found[key] = other
                if former is not None and other != former:
                    self._report(at, "deleted here and changed there: it stays", other)
        order = _merged_sequence(tuple(old), tuple(here), tuple(there), keep=set(found))
        return tuple(found[key] for key in order)

    def consistent(self, document: Document, mine: Document, theirs: Document) -> Document:
        """Return a merged document in which nothing names what the other side deleted."""
        ids = {automaton.id for automaton in document.automata}
        dangling = _dangling(mine) | _dangling(theirs)
        begins = {automaton.id: _initial(automaton) for automaton in mine.automata}
        automata = []
        for automaton in document.automata:
            states = tuple(self._without_lost(state, automaton, ids, dangling) for state in automaton.states)
            initial = _initial(automaton)
            if len(initial) > 1 and len(begins.get(automaton.id, ())) == 1:
                (kept,) = begins[automaton.id]
                place = Place(kind="automaton", automaton=automaton.id)
                self.conflicts.append(Conflict(place=place, message="both chose where it begins: mine stays"))
                states = tuple(
                    replace(state, initial=False) if state.initial and state.id != kept else state
                    for state in states
                )
            transitions = self._whole_transitions(automaton, dangling)
            automata.append(replace(automaton, states=states, transitions=transitions))
        merged = replace(document, automata=tuple(automata))
        self._report_lost(merged, mine, theirs)
        return merged

    def _without_lost(
        self, state: State, automaton: Automaton, ids: set[int], dangling: set[tuple[int, ...]]
    ) -> State:
        lost = [
            child
            for child in state.children
            if child not in ids and (automaton.id, state.id, child) not in dangling
        ]
        if not lost:
            return state
        place = Place(kind="state", automaton=automaton.id, id=state.id)
        self._report(place, "an automaton of it was deleted on the other side", state)
        return replace(state, children=tuple(child for child in state.children if child not in lost))

    def _whole_transitions(
        self, automaton: Automaton, dangling: set[tuple[int, ...]]
    ) -> tuple[Transition, ...]:
        states = {state.id for state in automaton.states}
        kept = []
        for each in automaton.transitions:
            if {each.origin, each.destination} <= states or (automaton.id, each.id) in dangling:
                kept.append(each)
            else:
                place = Place(kind="automaton", automaton=automaton.id)
                self._report(place, "a transition went with a state that was deleted on the other side", each)
        return tuple(kept)

    def _report_lost(self, merged: Document, mine: Document, theirs: Document) -> None:
        owned = owners(merged)
        before = {*_lost(mine), *_lost(theirs)}
        for automaton in merged.automata:
            if automaton.father != NO_CHILD and automaton.id not in owned and automaton.id not in before:
                place = Place(kind="automaton", automaton=automaton.id)
                message = "changed on one side, and its state deleted on the other: no state owns it"
                self.conflicts.append(Conflict(place=place, message=message))

    def _report(self, place: Place, message: str, node: Node) -> None:
        self.conflicts.append(Conflict(place=place, message=message, mine=shown(getattr(node, "name", ""))))


def _merged_sequence(
    base: Sequence[_T], mine: Sequence[_T], theirs: Sequence[_T], keep: Iterable[_T] | None = None
) -> tuple[_T, ...]:
    """Return the items of two sequences in the order of the side that changed it, mine if both did.

    Those that one side removed are left out unless they are to be kept.
    """
    kept = (
        set(keep)
        if keep is not None
        else {item for item in (*mine, *theirs) if (item in mine and item in theirs) or item not in base}
    )
    common = [item for item in base if item in set(mine) and item in set(theirs)]
    same_order = [item for item in mine if item in set(common)] == common
    spine, other = (theirs, mine) if same_order else (mine, theirs)
    order = list(dict.fromkeys(spine))
    present = set(order)
    before: _T | None = None
    for item in other:
        if item not in present:
            order.insert(order.index(before) + 1 if before is not None else 0, item)
            present.add(item)
        before = item
    return tuple(item for item in order if item in kept)


def _with_own_numbers(base: Document, mine: Document, theirs: Document) -> Document:
    """Return their version with other ids for what is new in it and collides with what is new in mine."""
    old = {automaton.id: automaton for automaton in base.automata}
    here = {automaton.id: automaton for automaton in mine.automata}
    there = {automaton.id: automaton for automaton in theirs.automata}
    colliding = [
        number for number in there if number not in old and number in here and here[number] != there[number]
    ]
    free = free_ids((*old, *here, *there))
    numbers = {number: next(free) for number in colliding}
    automata = []
    for automaton in theirs.automata:
        renumbered = automaton
        if automaton.id in old and automaton.id in here:
            renumbered = _with_own_items(old[automaton.id], here[automaton.id], automaton)
        if numbers:
            renumbered = replace(
                renumbered,
                id=numbers.get(automaton.id, automaton.id),
                father=numbers.get(automaton.father, automaton.father),
                states=tuple(_with_children(state, numbers) for state in renumbered.states),
            )
        automata.append(renumbered)
    return replace(theirs, automata=tuple(automata))


def _with_children(state: State, numbers: dict[int, int]) -> State:
    return replace(
        state,
        children=tuple(numbers.get(child, child) for child in state.children),
        arguments=tuple(replace(each, child=numbers.get(each.child, each.child)) for each in state.arguments),
    )


def _with_own_items(base: Automaton, mine: Automaton, theirs: Automaton) -> Automaton:
    states = _new_numbers(base.states, mine.states, theirs.states)
    transitions = _new_numbers(base.transitions, mine.transitions, theirs.transitions)
    if not states and not transitions:
        return theirs
    return replace(
        theirs,
        states=tuple(replace(each, id=states.get(each.id, each.id)) for each in theirs.states),
        transitions=tuple(
            replace(
                each,
                id=transitions.get(each.id, each.id),
                origin=states.get(each.origin, each.origin),
                destination=states.get(each.destination, each.destination),
            )
            for each in theirs.transitions
        ),
    )


def _new_numbers(
    base: Sequence[State | Transition],
    mine: Sequence[State | Transition],
    theirs: Sequence[State | Transition],
) -> dict[int, int]:
    old = {each.id for each in base}
    here = {each.id: each for each in mine}
    free = free_ids((*old, *here, *(each.id for each in theirs)))
    return {
        each.id: next(free)
        for each in theirs
        if each.id not in old and each.id in here and here[each.id] != each
    }


def _dangling(document: Document) -> set[tuple[int, ...]]:
    """Return what names something that is not there: transitions, and children of states."""
    ids = {automaton.id for automaton in document.automata}
    found: set[tuple[int, ...]] = set()
    for automaton in document.automata:
        states = {state.id for state in automaton.states}
        for transition in automaton.transitions:
            if not {transition.origin, transition.destination} <= states:
                found.add((automaton.id, transition.id))
        for state in automaton.states:
            found.update((automaton.id, state.id, child) for child in state.children if child not in ids)
    return found


def _lost(document: Document) -> set[int]:
    owned = owners(document)
    return {automaton.id for automaton in document.automata if automaton.id not in owned}


def _initial(automaton: Automaton) -> tuple[int, ...]:
    return tuple(state.id for state in automaton.states if state.initial)


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
