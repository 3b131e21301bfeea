"""Apply to a native document what another program has changed in the SCXML that was written of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Final, TypeVar

from ..document import Automaton, Document, Node, Parameter, State, Text, Transition

__all__ = ["REF", "apply_changes", "ref_of"]

REF: Final = "ref"
"""The attribute by which, while a file is read, a part of the chart refers to the native document."""

_STATE: Final = ("name", "initial", "final", "children", "history", "entry", "exit", "comments")
_TRANSITION: Final = ("origin", "destination", "type", "trigger", "guard", "code", "comments")
_AUTOMATON: Final = ("father", "variables", "comments")

_N = TypeVar("_N", Automaton, State, Transition)


def apply_changes(native: Document, written: Document, found: Document) -> Document:
    """Return the native document with the changes from the chart `written` of it to the chart `found`."""
    if written == found:
        return native
    originals = {str(place): each for place, each in enumerate(native.automata, 1)}
    charts = {ref_of(each): each for each in written.automata}
    automata: list[tuple[int | None, Automaton]] = []
    for automaton in found.automata:
        ref = ref_of(automaton)
        if ref in charts:
            changed = _changed_automaton(originals[ref], charts[ref], automaton)
            automata.append((int(ref), changed))
        else:
            parts = [replace(each, attributes=()) for each in automaton.states]
            edges = [replace(each, attributes=()) for each in automaton.transitions]
            new = replace(automaton, attributes=(), states=tuple(parts), transitions=tuple(edges))
            automata.append((None, new))
    automata += [(int(ref), each) for ref, each in originals.items() if ref not in charts]
    language = native.language if found.language == written.language else found.language
    parameters = _changed_parameters(native, written, found)
    return replace(native, language=language, parameters=parameters, automata=_in_order(automata))


def ref_of(node: Node) -> str:
    """Return to what in the native document a part of a chart refers, blank for nothing."""
    return dict(node.attributes).get(REF, "")


def _changed_automaton(native: Automaton, written: Automaton, found: Automaton) -> Automaton:
    states = _by_ref(native.states, written.states)
    changed_states = tuple(_changed(each, states, _STATE) for each in found.states)
    edges = _by_ref(native.transitions, written.transitions)
    numbered = [(_place(each), _changed(each, edges, _TRANSITION)) for each in found.transitions]
    known = {_place(each) for each in written.transitions}
    numbered += [(n, each) for n, each in enumerate(native.transitions, 1) if n not in known]
    changed = _changed(found, {ref_of(written): (native, written)}, _AUTOMATON)
    if found.variables != written.variables and not written.variables.text and native.variables.text:
        added = f"{native.variables.text}\n{found.variables.text}"
        changed = replace(changed, variables=replace(native.variables, text=added))
    changed = replace(changed, states=changed_states, transitions=_in_order(numbered))
    return _with_priorities(changed, found)


def _by_ref(natives: Iterable[_N], written: Iterable[_N]) -> dict[str, tuple[_N, _N]]:
    """Return by their references the parts of a native document that have a place in the chart of it."""
    places = dict(enumerate(natives, 1))
    return {ref_of(each): (places[place], each) for each in written if (place := _place(each)) in places}


def _place(node: Node) -> int | None:
    """Return at which place in its automaton a state or transition stands in the native document."""
    place = ref_of(node).partition(".")[2]
    return int(place) if place.isascii() and place.isdigit() and len(place) < 10 else None


def _changed(found: _N, known: dict[str, tuple[_N, _N]], names: tuple[str, ...]) -> _N:
    """Return a native part with what differs in the chart; the id is always the chart's."""
    ref = ref_of(found)
    if ref not in known:
        return replace(found, attributes=())
    native, written = known[ref]
    differing = {
        name: getattr(found, name) for name in names if getattr(found, name) != getattr(written, name)
    }
    return replace(native, id=found.id, **differing)


def _changed_parameters(native: Document, written: Document, found: Document) -> tuple[Parameter, ...]:
    if found.parameters == written.parameters:
        return native.parameters
    known = {each.name: each for each in native.parameters}
    names = {each.name for each in written.parameters}
    kept = [each for each in native.parameters if each.name not in names]
    merged = [
        replace(
            known.get(each.name, each),
            type=each.type,
            default=each.default,
            description=each.description,
        )
        for each in found.parameters
    ]
    return (*kept, *merged)


def _in_order(items: Iterable[tuple[int | None, _N]]) -> tuple[_N, ...]:
    """Return items by their places in the native document; one without stays behind the one before it."""
    placed: list[tuple[int, _N]] = []
    last = -1
    for place, item in items:
        last = place if place is not None else last
        placed.append((last, item))
    return tuple(item for _, item in sorted(placed, key=lambda each: each[0]))


def _with_priorities(automaton: Automaton, chart: Automaton) -> Automaton:
    """Return an automaton whose transitions are tried in the order of the chart."""
    changed: dict[int, Text] = {}
    for state in chart.states:
        wanted = [each.id for each in chart.outgoing(state.id)]
        outgoing = automaton.outgoing(state.id)
        if [each.id for each in outgoing if each.id in wanted] != wanted:
            changed |= {number: Text(str(rank)) for rank, number in enumerate(wanted, 1)}
    return replace(
        automaton,
        transitions=tuple(
            replace(each, priority=changed[each.id]) if each.id in changed else each
            for each in automaton.transitions
        ),
    )
