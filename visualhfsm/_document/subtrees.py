"""Find what is below a state: the automata that it owns, with all below them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from codegen.graphs import reached
from codegen.hfsm.document import NO_CHILD, Automaton, Document, State


def owners(document: Document) -> dict[int, list[tuple[Automaton, State]]]:
    """Return the owners of each automaton: states, each with its automaton."""
    found: dict[int, list[tuple[Automaton, State]]] = {}
    for automaton, state in document.states():
        for child in dict.fromkeys(state.children):
            found.setdefault(child, []).append((automaton, state))
    return found


def below(document: Document, ids: Iterable[int]) -> list[Automaton]:
    """Return automata by their ids and all below them, each once and before its children."""
    by_id: dict[int, list[Automaton]] = {}
    for automaton in document.automata:
        by_id.setdefault(automaton.id, []).append(automaton)
    found: list[Automaton] = []
    pending = list(reversed(list(ids)))
    while pending:
        for automaton in by_id.pop(pending.pop(), ()):
            found.append(automaton)
            pending += [child for state in reversed(automaton.states) for child in reversed(state.children)]
    return found


def hanging(document: Document, automaton: Automaton, states: Iterable[State]) -> set[int]:
    """Return the ids of the automata that are deleted with states of `automaton`.

    An automaton that another state owns, too, is kept, and so is everything above `automaton` in a tree with
    a cycle.
    """
    doomed_states = {id(state) for state in states}
    owned_by = owners(document)
    lost: dict[int, list[int]] = {}
    for each in document.automata:
        if each.id not in owned_by:
            lost.setdefault(each.father, []).append(each.id)
    by_id = {each.id: each for each in document.automata}
    kept = reached([automaton.id], lambda each: _above(each, by_id, owned_by))
    doomed: set[int] = set()
    pending = [
        child for _, state in document.states() if id(state) in doomed_states for child in state.children
    ]
    while pending:
        child = pending.pop()
        found = by_id.get(child)
        if child in kept or child in doomed or found is None:
            continue
        if any(id(owner) not in doomed_states for _, owner in owned_by.get(child, ())):
            continue
        doomed.add(child)
        doomed_states.update(id(state) for state in found.states)
        pending += [grandchild for state in found.states for grandchild in state.children]
        pending += lost.get(child, ())
    return doomed


def without_automata(document: Document, ids: set[int]) -> Document:
    """Return a document without some automata, and without references to them."""
    if not ids:
        return document
    automata = tuple(
        replace(automaton, states=tuple(_without_children(state, ids) for state in automaton.states))
        if any(ids.intersection(state.children) for state in automaton.states)
        else automaton
        for automaton in document.automata
        if automaton.id not in ids
    )
    return replace(document, automata=automata)


def renumbered(automaton: Automaton, numbers: Mapping[int, int], father: int) -> Automaton:
    """Return an automaton as part of another tree: `numbers` has the new ids of all that are moved.

    `father` is the id of the automaton above if that is not moved.
    """
    return replace(
        automaton,
        id=numbers[automaton.id],
        father=numbers.get(automaton.father, father),
        states=tuple(renumbered_state(state, numbers) for state in automaton.states),
    )


def renumbered_state(state: State, numbers: Mapping[int, int]) -> State:
    """Return a state with the new ids of its automata, without those that are not moved."""
    children = tuple(numbers[child] for child in state.children if child in numbers)
    arguments = tuple(
        replace(argument, child=numbers.get(argument.child, NO_CHILD)) for argument in state.arguments
    )
    results = tuple(replace(result, child=numbers.get(result.child, NO_CHILD)) for result in state.results)
    return replace(state, children=children, arguments=arguments, results=results)


def _without_children(state: State, ids: set[int]) -> State:
    if not ids.intersection(state.children):
        return state
    return replace(
        state,
        children=tuple(child for child in state.children if child not in ids),
        arguments=tuple(argument for argument in state.arguments if argument.child not in ids),
        results=tuple(result for result in state.results if result.child not in ids),
    )


def _above(
    automaton: int, by_id: Mapping[int, Automaton], owned_by: Mapping[int, list[tuple[Automaton, State]]]
) -> Iterator[int]:
    """Yield the automata right above one, by its owners and by what it says itself."""
    yield from (father.id for father, _ in owned_by.get(automaton, ()))
    if automaton in by_id and by_id[automaton].father != NO_CHILD:
        yield by_id[automaton].father
