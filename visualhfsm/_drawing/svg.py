"""Draw an automaton as an SVG picture, without a browser."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Final
from xml.etree.ElementTree import Element

from codegen.hfsm.document import Automaton, Document
from visualhfsm._base.errors import MissingError
from visualhfsm._document.geometry import spread
from visualhfsm._drawing.annotations import box_of, draw_annotations
from visualhfsm._drawing.arcs import RADIUS, Box, arc, handles, place
from visualhfsm._drawing.elements import element, pixels, written
from visualhfsm._drawing.states import draw_state
from visualhfsm._drawing.symbols import PAPER
from visualhfsm._drawing.text import FAMILY
from visualhfsm._drawing.transitions import HANDLE, DrawnTransition

_MARGIN: Final = 24.0
_MANY: Final = 200
"""Of more transitions each label stands at its best side, whatever is there."""
_EMPTY: Final = Box(0.0, 0.0, 200.0, 100.0)


def svg(document: Document, automaton_id: int, *, component: str = "root") -> str:
    """Draw one automaton of a document as an SVG picture, and return its text.

    It shows states with their names and signs, transitions with what fires them, notes and frames, in light
    colours; lengths are in pixels. States that all have the same position stand on a circle. The text is a
    whole file, which needs no style sheet, no script and no font. Its title is the name of the state that
    owns the automaton, for the root `component`. Raises MissingError when the document has no automaton with
    this id.
    """
    automaton = document.automaton(automaton_id)
    if automaton is None:
        known = ", ".join(str(each.id) for each in document.automata) or "none"
        raise MissingError.because(
            "the document has no automaton {automaton_id}: its automata are {known}",
            automaton_id=automaton_id,
            known=known,
        )
    title = _title(document, automaton, component)
    automaton = spread(automaton)
    transitions = _apart(automaton, list(_transitions(automaton)))
    boxes = [Box.around(middle, 2 * RADIUS, 2 * RADIUS) for middle in map(place, automaton.states)]
    boxes += [each.arc.box for each in transitions]
    boxes += filter(None, (each.box() for each in transitions))
    boxes += map(box_of, automaton.annotations)
    layers = (
        *([draw_annotations(automaton.annotations)] if automaton.annotations else []),
        element("g", *(each.line() for each in transitions)),
        element("g", *(each.text() for each in transitions)),
        element("g", *_states(document, automaton), text_anchor="middle"),
    )
    return written(_sheet(title, boxes, layers))


def _transitions(automaton: Automaton) -> Iterator[DrawnTransition]:
    """Yield what is drawn of each transition, in the order of the document."""
    places: dict[int, complex] = {}
    for state in automaton.states:
        places.setdefault(state.id, place(state))
    ranks = {
        id(transition): rank
        for leaving in automaton.all_outgoing().values()
        if len(leaving) > 1
        for rank, transition in enumerate(leaving, start=1)
    }
    found = handles(automaton.transitions, places)
    for transition, handle in zip(automaton.transitions, found, strict=True):
        line = arc(
            places.get(transition.origin),
            places.get(transition.destination),
            handle,
            is_loop=transition.origin == transition.destination,
        )
        yield DrawnTransition(transition, line, ranks.get(id(transition), 0), line.normal)


def _apart(automaton: Automaton, transitions: list[DrawnTransition]) -> list[DrawnTransition]:
    """Return the transitions with their labels off states, handles and each other where that is easy."""
    if len(transitions) > _MANY:
        return transitions
    taken = [Box.around(place(state), 2 * RADIUS, 2 * RADIUS) for state in automaton.states]
    taken += [Box.around(each.arc.handle, 2 * HANDLE, 2 * HANDLE) for each in transitions]
    found = []
    for each in transitions:
        found.append(each.beside(taken))
        taken += filter(None, [found[-1].box()])
    return found


def _states(document: Document, automaton: Automaton) -> Iterator[Element]:
    foreign = {
        each.id for each in document.automata if each.imported is not None or each.path != automaton.path
    }
    for state in automaton.states:
        yield draw_state(state, is_importing=not foreign.isdisjoint(state.children))


def _title(document: Document, automaton: Automaton, component: str) -> str:
    if automaton is document.root:
        return component
    owner = document.owner(automaton)
    return (owner.name if owner else "") or f"automaton {automaton.id}"


def _sheet(title: str, boxes: Sequence[Box], layers: Iterable[Element]) -> Element:
    """Return the picture with a margin around everything."""
    box = boxes[0] if boxes else _EMPTY
    for each in boxes:
        box = box.united(each)
    left = math.floor(box.left - _MARGIN)
    top = math.floor(box.top - _MARGIN)
    width = math.ceil(box.right - box.left + 2 * _MARGIN)
    height = math.ceil(box.bottom - box.top + 2 * _MARGIN)
    return element(
        "svg",
        element("title", text=title),
        element("rect", x=left, y=top, width=width, height=height, fill=PAPER),
        *layers,
        viewBox=f"{pixels(left)} {pixels(top)} {pixels(width)} {pixels(height)}",
        width=width,
        height=height,
        font_family=FAMILY,
    )
