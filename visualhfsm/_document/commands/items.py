"""Commands for a selection on the canvas: states, transitions and annotations together."""

# ruff: noqa: ARG002 - `Command` documents its methods and their parameters

from __future__ import annotations

from collections.abc import Hashable
from functools import partial
from typing import Final, Literal

import msgspec

from codegen.hfsm.document import Automaton, Document
from codegen.messages import Message, all_of

from .. import nodes
from ..geometry import Point, moved, with_default_handles
from ..subtrees import hanging, without_automata
from .base import AUTOMATIC_LAYOUT, AutomatonCommand, Command, Id, Ids, step_name


class DeleteItems(Command, frozen=True, kw_only=True):
    """Delete states, transitions and annotations.

    The transitions at those states go, too, and all automata below them; what a frame holds stays.
    """

    automaton: Id
    states: Ids = ()
    transitions: Ids = ()
    annotations: Ids = ()
    cut: bool = False
    """True if they were cut to the clipboard; affects only the name of the step."""

    def apply(self, document: Document) -> Document:
        automaton = nodes.find_automaton(document, self.automaton)
        states = [nodes.find_state(automaton, number) for number in self.states]
        transitions = {id(nodes.find_transition(automaton, number)) for number in self.transitions}
        annotations = {nodes.find_annotation(automaton, number).id for number in self.annotations}
        document = without_automata(document, hanging(document, automaton, states))
        gone = set(self.states)

        def delete(automaton: Automaton) -> Automaton:
            return nodes.changed(
                automaton,
                states=tuple(state for state in automaton.states if state.id not in gone),
                transitions=tuple(
                    each
                    for each in automaton.transitions
                    if id(each) not in transitions and not gone & {each.origin, each.destination}
                ),
                annotations=tuple(each for each in automaton.annotations if each.id not in annotations),
            )

        return nodes.with_automaton(document, self.automaton, delete)

    def title(self, document: Document) -> Message:
        what = describe(document, self.automaton, self.states, self.transitions, self.annotations)
        return Message("Cut {what}", what=what) if self.cut else Message("Delete {what}", what=what)


class MoveItems(AutomatonCommand, frozen=True, kw_only=True):
    """Move states, handles and annotations by some pixels.

    The handles of other transitions follow their states. A frame alone does not move what it holds.
    """

    states: Ids = ()
    transitions: Ids = ()
    annotations: Ids = ()
    dx: float
    dy: float

    def change(self, automaton: Automaton) -> Automaton:
        shift = (self.dx, self.dy)
        states = {nodes.find_state(automaton, number).id: shift for number in self.states}
        handles = {nodes.find_transition(automaton, number).id: shift for number in self.transitions}
        annotations = {nodes.find_annotation(automaton, number).id: shift for number in self.annotations}
        return moved(automaton, states, handles, annotations)

    def title(self, document: Document) -> Message:
        what = describe(document, self.automaton, self.states, self.transitions, self.annotations)
        return Message("Move {what}", what=what)

    @property
    def merge_key(self) -> Hashable:
        chosen = map(frozenset, (self.states, self.transitions, self.annotations))
        return type(self), self.automaton, *chosen


_SIDES: Final = {
    "left": Message("left"),
    "center": Message("center"),
    "right": Message("right"),
    "top": Message("top"),
    "middle": Message("middle"),
    "bottom": Message("bottom"),
}


class AlignStates(AutomatonCommand, frozen=True, kw_only=True):
    """Align states at the outermost of them, or in the middle between both ends."""

    states: Ids
    to: Literal["left", "center", "right", "top", "middle", "bottom"]

    def change(self, automaton: Automaton) -> Automaton:
        states = [nodes.find_state(automaton, number) for number in self.states]
        if len(states) < 2:
            return automaton
        horizontal = self.to in ("left", "center", "right")
        places = [state.x if horizontal else state.y for state in states]
        if self.to in ("left", "top"):
            line = min(places)
        elif self.to in ("right", "bottom"):
            line = max(places)
        else:
            line = (min(places) + max(places)) / 2
        shifts = [line - place for place in places]
        return moved(automaton, _shifts(self.states, shifts, horizontal=horizontal), {})

    def title(self, document: Document) -> Message:
        what = describe(document, self.automaton, self.states)
        return Message("Align {what}: {side}", what=what, side=_SIDES[self.to])


class DistributeStates(AutomatonCommand, frozen=True, kw_only=True):
    """Distribute states at equal distances between the two outermost."""

    states: Ids
    along: Literal["x", "y"]

    def change(self, automaton: Automaton) -> Automaton:
        states = [nodes.find_state(automaton, number) for number in dict.fromkeys(self.states)]
        if len(states) < 3:
            return automaton
        horizontal = self.along == "x"
        places = sorted((state.x if horizontal else state.y, state.id) for state in states)
        first, last = places[0][0], places[-1][0]
        step = (last - first) / (len(places) - 1)
        ids = tuple(number for _, number in places)
        shifts = [first + step * index - place for index, (place, _) in enumerate(places)]
        return moved(automaton, _shifts(ids, shifts, horizontal=horizontal), {})

    def title(self, document: Document) -> Message:
        return Message("Distribute {what}", what=describe(document, self.automaton, self.states))


class ResetHandles(AutomatonCommand, frozen=True, kw_only=True):
    """Move handles to their default places."""

    transitions: Ids

    def change(self, automaton: Automaton) -> Automaton:
        ids = frozenset(nodes.find_transition(automaton, number).id for number in self.transitions)
        return with_default_handles(automaton, ids)

    def title(self, document: Document) -> Message:
        return Message(
            "Reset the handle of {what}", what=describe(document, self.automaton, (), self.transitions)
        )


class Placement(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename="camel"):
    """New places of one automaton's states and handles, each `[id, x, y]`, and of its annotations.

    Those of annotations have a size, too: `[id, x, y, width, height]`.
    """

    automaton: Id
    states: tuple[tuple[Id, float, float], ...] = ()
    transitions: tuple[tuple[Id, float, float], ...] = ()
    annotations: tuple[tuple[Id, float, float, float, float], ...] = ()


class PlaceItems(Command, frozen=True, kw_only=True):
    """Place states, handles and annotations of any number of automata, as after an automatic layout.

    Handles that are not given move to their default places.
    """

    placements: tuple[Placement, ...]
    name: str = str(AUTOMATIC_LAYOUT)

    def apply(self, document: Document) -> Document:
        for placement in self.placements:
            document = nodes.with_automaton(document, placement.automaton, partial(_placed, placement))
        return document

    def title(self, document: Document) -> Message:
        return step_name(self.name)


def describe(
    document: Document, number: int, states: Ids, transitions: Ids = (), annotations: Ids = ()
) -> Message:
    """Return a name for some states, transitions and annotations of an automaton together."""
    automaton = nodes.find_automaton(document, number)
    if annotations:
        chosen = [nodes.find_annotation(automaton, number) for number in annotations]
        frames = [each for each in chosen if each.kind == "frame"]
        if len(frames) == 1:
            return nodes.described(frames[0])  # with what it holds
        if len(chosen) == 1 and not states and not transitions:
            return nodes.described(chosen[0])
    if len(states) == 1 and not transitions:
        return nodes.label(nodes.find_state(automaton, states[0]))
    if len(transitions) == 1 and not states:
        return nodes.label(nodes.find_transition(automaton, transitions[0]))
    parts = []
    if states:
        parts.append(Message.counted("{count} state", "{count} states", count=len(states)))
    if transitions:
        parts.append(Message.counted("{count} transition", "{count} transitions", count=len(transitions)))
    if annotations:
        parts.append(Message.counted("{count} note", "{count} notes", count=len(annotations)))
    return all_of(parts) if parts else Message("nothing")


def _shifts(ids: Ids, distances: list[float], *, horizontal: bool) -> dict[int, Point]:
    return {
        number: (distance, 0.0) if horizontal else (0.0, distance)
        for number, distance in zip(ids, distances, strict=True)
    }


def _placed(placement: Placement, automaton: Automaton) -> Automaton:
    states = {state.id: state for state in automaton.states}
    handles = {transition.id: transition for transition in automaton.transitions}
    for number, _, _ in placement.states:
        if number not in states:
            nodes.find_state(automaton, number)
    for number, _, _ in placement.transitions:
        if number not in handles:
            nodes.find_transition(automaton, number)
    shifts = {number: (x - states[number].x, y - states[number].y) for number, x, y in placement.states}
    handle_shifts = {
        number: (x - handles[number].x, y - handles[number].y) for number, x, y in placement.transitions
    }
    automaton = moved(automaton, shifts, handle_shifts)
    for number, x, y, width, height in placement.annotations:
        former = nodes.find_annotation(automaton, number)
        new = nodes.changed(
            former,
            x=nodes.coordinate(x),
            y=nodes.coordinate(y),
            width=nodes.size(width),
            height=nodes.size(height),
        )
        automaton = nodes.changed(automaton, annotations=nodes.swapped(automaton.annotations, former, new))
    moved_ends = frozenset(
        transition.id
        for transition in automaton.transitions
        if transition.id not in handle_shifts
        and not shifts.keys().isdisjoint((transition.origin, transition.destination))
    )
    return with_default_handles(automaton, moved_ends)
