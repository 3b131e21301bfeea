"""Draw an automaton as an SVG picture, without a browser, as the editor's canvas draws it."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Final
from xml.etree.ElementTree import Element

from codegen.hfsm.document import Automaton, Document
from visualhfsm._base.errors import MissingError
from visualhfsm._document.geometry import spread
from visualhfsm._drawing.annotations import box_of, draw_annotations, occupied
from visualhfsm._drawing.arcs import RADIUS, Box, arc, handles, place
from visualhfsm._drawing.elements import element, pixels, written
from visualhfsm._drawing.labels import place_labels
from visualhfsm._drawing.states import draw_state
from visualhfsm._drawing.symbols import PAPER
from visualhfsm._drawing.text import FAMILY
from visualhfsm._drawing.transitions import DrawnTransition

_MARGIN: Final = 24.0
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
    transitions = list(_transitions(automaton))
    labels = [each.label() for each in transitions]
    middles = [place(state) for state in automaton.states]
    spots = place_labels(
        labels,
        middles,
        [each.arc for each in transitions],
        occupied=chain.from_iterable(map(occupied, automaton.annotations)),
    )
    boxes = [Box.around(middle, 2 * RADIUS, 2 * RADIUS) for middle in middles]
    boxes += [each.arc.box for each in transitions]
    boxes += [
        Box.around(spot.middle, *label.sizes[spot.size])
        for spot, label in zip(spots, labels, strict=True)
        if spot is not None
    ]
    boxes += map(box_of, automaton.annotations)
    layers = (
        *([draw_annotations(automaton.annotations)] if automaton.annotations else []),
        element("g", *(each.line() for each in transitions)),
        element(
            "g",
            *(each.text(spot) for each, spot in zip(transitions, spots, strict=True)),
            text_anchor="middle",
        ),
        element("g", *_states(document, automaton, transitions), text_anchor="middle"),
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
        yield DrawnTransition(transition, line, ranks.get(id(transition), 0))


def _states(
    document: Document, automaton: Automaton, transitions: Sequence[DrawnTransition]
) -> Iterator[Element]:
    touched: dict[int, list[complex]] = {}
    for each in transitions:
        if each.arc.start is not None and each.arc.end is not None:
            touched.setdefault(each.transition.origin, []).append(each.arc.start)
            touched.setdefault(each.transition.destination, []).append(each.arc.end)
    foreign = {
        each.id for each in document.automata if each.imported is not None or each.path != automaton.path
    }
    for state in automaton.states:
        angles = [cmath.phase(end - place(state)) for end in touched.get(state.id, ())]
        yield draw_state(state, angles, is_importing=not foreign.isdisjoint(state.children))


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
