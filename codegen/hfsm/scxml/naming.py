"""Name the states, histories, regions, timers and events of a document as SCXML allows it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..document import Document
from ..formats.xml_tree import XmlElement
from .own_elements import with_comments
from .placement import PlacedState, PlacedTransition, Placement
from .vocabulary import delay_text, encode_event, identifier, is_first_words

__all__ = ["Names", "Timer", "native_order"]


class Timer(NamedTuple):
    """The event that a state sends to itself, the id of its sending, and its delay."""

    event: str
    id: str
    delay: str


class Names:
    """The ids of a file, each once; states and regions are given theirs.

    `histories` are the ids of histories by their states, `events` the names of events by their native ones,
    `beside` the states of one automaton, by their ids, for each of them.
    """

    def __init__(self, document: Document, placement: Placement) -> None:
        self.used: set[str] = set()
        self.histories: dict[PlacedState, str] = {}
        self.beside: dict[PlacedState, dict[int, PlacedState]] = {}
        self.events = _events(document, placement)
        for automaton in placement.automata:
            # Where an id repeats the first state has it.
            beside = {state.state.id: state for state in reversed(automaton.states)}
            for state in automaton.states:
                self.beside[state] = beside
                state.id = self._new(state.state.name)
        for automaton in placement.automata:
            for state in automaton.states:
                if len(state.automata) > 1:
                    for child in state.automata:
                        child.id = self._new(f"{state.id}_{child.automaton.id}")
                if state.resumes:
                    self.histories[state] = self._new(f"{state.id}_history")

    def timers(self, placed: PlacedState) -> dict[PlacedTransition, Timer]:
        """Return the timers of a state by its transitions, under new names."""
        found = {}
        for each in placed.transitions:
            delay = delay_text(each.transition.trigger.text) if each.transition.type == "time" else None
            if delay is not None:
                name = self._new(f"{placed.id}_timer_{each.transition.id}")
                found[each] = Timer(f"timeout.{name}", name, delay)
        return found

    def _new(self, text: str) -> str:
        base = identifier(text, "state")
        found, number = base, 1
        while found in self.used:
            number += 1
            found = f"{base}_{number}"
        self.used.add(found)
        return found


def native_order(native: XmlElement, placement: Placement) -> dict[XmlElement, int]:
    """Return the places of automata and transitions in a document, where SCXML has them in another order."""
    found: dict[XmlElement, int] = {}

    def compare(parent: XmlElement, tag: str, written: Sequence[XmlElement]) -> None:
        own = [item for _, item in with_comments(parent) if item.tag == tag]
        if own != written:
            found.update({element: index for index, element in enumerate(own)})

    for automaton in placement.automata:
        compare(automaton.native, "transition", [each.native for each in automaton.transitions()])
    written = [automaton.native for automaton in (*placement.automata, *placement.lost)]
    compare(native, "SubAutomata", written)
    return found


def _events(document: Document, placement: Placement) -> dict[str, str]:
    used = {
        each.transition.trigger.text
        for automaton in placement.automata
        for each in automaton.transitions()
        if each.transition.type == "event"
    }
    known = used | {event.name for event in document.events}
    return {
        name: encode_event(name, dots=any(is_first_words(other, name) for other in known)) for name in used
    }
