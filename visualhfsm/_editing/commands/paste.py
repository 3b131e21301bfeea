"""Commands that insert text: states from the clipboard, and whole documents."""

# ruff: noqa: ARG002 - `Command` documents its methods and their parameters

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from codegen.hfsm.document import Automaton, Document, Node, State, Transition
from visualhfsm._errors import EditError

from ..diff import KEYS
from ..geometry import Point
from ..nodes import (
    MAX_AUTOMATA,
    automaton_ids,
    changed,
    coordinate,
    find_automaton,
    free_name,
    state_ids,
    swapped,
    transition_ids,
)
from ..serialization import parse
from ..subtrees import hanging, renumbered, renumbered_state, without_automata
from .base import Command, Id

_STEP: Final = 30.0
"""Pixels by which states that would cover others are shifted, repeatedly."""
_NEAR: Final = range(-2, 3)
"""Distances in steps at which two circles still touch."""


class PasteStates(Command, frozen=True, kw_only=True):
    """Paste a fragment into an automaton, with new numbers.

    Its upper left corner is placed at `x`, `y`, by default where it was copied from, shifted so as not to
    cover other states. Names are kept if they are free. A pasted state is initial only if the automaton has
    no initial state.
    """

    automaton: Id
    content: str
    x: float | None = None
    y: float | None = None
    name: str = ""

    def apply(self, document: Document) -> Document:
        target = find_automaton(document, self.automaton)
        if target.imported is not None:
            why = "its content comes from another file"
            raise EditError("Cannot paste into this automaton", why, "change that file, or inline it first")
        fragment = parse(self.content, "Cannot paste")
        if not fragment.automata or not fragment.automata[0].states:
            raise EditError("Cannot paste", "it contains no states", "copy states first")
        top, *others = fragment.automata
        numbers = _numbers(document, others)
        shift = self._shift(target, top)
        states = list(_pasted_states(target, top, numbers, shift))
        new_ids = {old.id: new.id for old, new in zip(top.states, states, strict=True)}
        transitions = list(_pasted_transitions(target, top, new_ids, shift))
        filled = replace(
            target,
            states=(*target.states, *states),
            transitions=(*target.transitions, *transitions),
        )
        pasted = tuple(renumbered(each, numbers, target.id) for each in others)
        return replace(document, automata=(*swapped(document.automata, target, filled), *pasted))

    def title(self, document: Document) -> str:
        return self.name[:80] or "Paste"

    def _shift(self, target: Automaton, top: Automaton) -> Point:
        left = min(state.x for state in top.states)
        upper = min(state.y for state in top.states)
        if self.x is not None and self.y is not None:
            return self.x - left, self.y - upper
        taken = {
            (across + right, down + below)
            for across, down in map(_square, target.states)
            for right in _NEAR
            for below in _NEAR
        }
        pasted = [_square(state) for state in top.states]
        steps = 0
        while any((across + steps, down + steps) in taken for across, down in pasted):
            steps += 1
        return steps * _STEP, steps * _STEP


def _square(state: State) -> tuple[int, int]:
    return round(state.x / _STEP), round(state.y / _STEP)


class FillAutomaton(Command, frozen=True, kw_only=True):
    """Replace the content of an automaton by that of the first one of a document, with all below it.

    Its former content or import is removed. Libraries, interfaces, parameters and events of that document are
    added where their names are free.
    """

    automaton: Id
    content: str
    name: str = ""

    def apply(self, document: Document) -> Document:
        fragment = parse(self.content, "Cannot fill the automaton")
        if not fragment.automata:
            raise EditError("Cannot fill the automaton", "the text contains none", "write one")
        target = find_automaton(document, self.automaton)
        document = without_automata(document, hanging(document, target, target.states))
        target = find_automaton(document, self.automaton)
        top, *others = fragment.automata
        numbers = _numbers(document, others)
        filled = replace(
            target,
            states=tuple(renumbered_state(state, numbers) for state in top.states),
            transitions=top.transitions,
            inputs=top.inputs,
            imported=None,
            iteration_time=top.iteration_time,
            variables=top.variables,
            functions=top.functions,
            extras=top.extras,
        )
        pasted = tuple(renumbered(each, numbers, target.id) for each in others)
        document = replace(document, automata=(*swapped(document.automata, target, filled), *pasted))
        return _with_declarations(document, fragment)

    def title(self, document: Document) -> str:
        return self.name[:80] or "Fill the automaton"


class ReplaceDocument(Command, frozen=True, kw_only=True):
    """Replace the whole document, such as by the result of a merge."""

    content: str
    name: str = ""

    def apply(self, document: Document) -> Document:
        new = parse(self.content, "Cannot replace the document")
        return document if new == document else new

    def title(self, document: Document) -> str:
        return self.name[:80] or "Replace the document"


def _with_declarations(document: Document, fragment: Document) -> Document:
    """Return a document with the declarations of another one added."""
    lists: dict[str, tuple[Node, ...]] = {}
    for name in ("libraries", "interfaces", "ros", "parameters", "events"):
        own: tuple[Node, ...] = getattr(document, name)
        known = {KEYS[name](item) for item in own}
        lists[name] = (*own, *(item for item in getattr(fragment, name) if KEYS[name](item) not in known))
    return changed(document, **lists)


def _numbers(document: Document, automata: list[Automaton]) -> dict[int, int]:
    """Return new ids for automata that are added to a document. Raises EditError for too many of them."""
    if len(document.automata) + len(automata) > MAX_AUTOMATA:
        why = f"the document would have more than {MAX_AUTOMATA} automata"
        raise EditError("Cannot add these automata", why, "move some to separate documents and import them")
    ids = automaton_ids(document)
    numbers: dict[int, int] = {}
    for automaton in automata:
        if automaton.id in numbers:
            why = f"two automata in it have the number {automaton.id}"
            raise EditError(
                "Cannot add these automata", why, "use `Repair numbers` in the document they come from"
            )
        numbers[automaton.id] = next(ids)
    return numbers


def _pasted_states(
    target: Automaton, top: Automaton, numbers: dict[int, int], shift: Point
) -> Iterator[State]:
    ids = state_ids(target)
    taken = {state.name for state in target.states}
    may_begin = not any(state.initial for state in target.states)
    for state in top.states:
        name = free_name(state.name, taken) if state.name.strip() else state.name
        taken.add(name)
        new = replace(
            renumbered_state(state, numbers),
            id=next(ids),
            initial=state.initial and may_begin,
            x=coordinate(state.x + shift[0]),
            y=coordinate(state.y + shift[1]),
        )
        may_begin = may_begin and not state.initial
        yield changed(new, name=name)


def _pasted_transitions(
    target: Automaton, top: Automaton, new_ids: dict[int, int], shift: Point
) -> Iterator[Transition]:
    ids = transition_ids(target)
    for transition in top.transitions:
        if transition.origin in new_ids and transition.destination in new_ids:
            yield replace(
                transition,
                id=next(ids),
                origin=new_ids[transition.origin],
                destination=new_ids[transition.destination],
                x=coordinate(transition.x + shift[0]),
                y=coordinate(transition.y + shift[1]),
            )
