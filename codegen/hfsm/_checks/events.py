"""Find events that are awaited but never sent, and events that nothing awaits.

An event reaches the automata that are active when it is sent, but no ghosts.
"""

from __future__ import annotations

import ast
from collections.abc import Collection

from ...diagnostics import Location, did_you_mean
from ...messages import Message
from .._effects import CodeEffects
from ..analysis import Piece
from ..code.text import all_nodes
from ..codes import Code
from ..document import REFUSED, Automaton, Document
from .report import Report, transition_label


def check_events(effects: CodeEffects, report: Report) -> None:
    """Compare the events that are awaited, sent and declared.

    Events that code sends through another name for the component count, too.
    """
    analysis = effects.analysis
    document = analysis.document
    has_own_send = "send" in analysis.defined  # the events that it sends are unknown
    senders = _Senders(effects)
    sent = {} if has_own_send else senders.first
    is_complete = analysis.is_complete and not has_own_send and not effects.unclear_sends
    declared = {event.name.strip(): report.place(event) for event in document.events}
    awaited: set[str] = set()
    for automaton in document.automata:
        for transition in automaton.transitions:
            name = transition.trigger.text.strip()
            if transition.type != "event" or not name:
                continue
            awaited.add(name)
            if name == REFUSED:
                continue  # the runtime sends it
            who = transition_label(transition)
            if is_complete and name not in {*sent, *declared}:
                message = Message(
                    "{transition} waits for the event `{name}`, which is neither sent nor declared",
                    transition=who,
                    name=name,
                )
                known = did_you_mean(name, {*sent, *declared}, "")
                report.warning(
                    Code.UNSENT_EVENT, message, report.place(transition, transition.trigger), known
                )
            elif is_complete and name not in declared and not senders.reach(name, automaton):
                message = Message(
                    "the event `{name}` is sent only while the automaton of {transition} is a ghost",
                    name=name,
                    transition=who,
                )
                report.warning(Code.UNSENT_EVENT, message, report.place(transition, transition.trigger))
    for name, place in {**sent, **declared}.items():
        if name not in awaited:
            message = Message("no transition waits for the event `{name}`", name=name)
            report.warning(
                Code.UNUSED_EVENT, message, place, did_you_mean(name, awaited, "" if name in sent else "name")
            )


class _Senders:
    """The pieces of code that send events, and whether they can run while an automaton is active."""

    def __init__(self, effects: CodeEffects) -> None:
        analysis = effects.analysis
        self._by_name: dict[str, dict[Piece, set[ast.AST]]] = {}
        self.first: dict[str, Location] = {}
        """The first place in which each event is sent."""
        for piece in analysis.pieces:
            for event, places in effects.of_piece(piece).events.items():
                self._by_name.setdefault(event, {})[piece] = places
                self.first.setdefault(event, min(map(piece.place, places), key=_position))
        self._owners = _owners_above(analysis.document)
        self._places: dict[Piece, tuple[int, int, bool]] = {}
        """The automaton and the state of each piece, and whether those below are active while it runs."""
        for code in analysis.automata:
            number = code.automaton.id
            for state in code.automaton.states:
                changes = [code.of("entry", state), code.of("exit", state)]
                changes += [code.of("argument", argument) for argument in state.arguments]
                self._add((number, state.id, True), code.of("code", state))
                self._add((number, state.id, False), *changes)
            for transition in code.automaton.transitions:
                self._add((number, transition.origin, True), code.of("guard", transition))
                self._add((number, transition.origin, False), code.of("fired", transition))

    def _add(self, place: tuple[int, int, bool], *pieces: Piece | None) -> None:
        self._places.update((piece, place) for piece in pieces if piece is not None)

    def reach(self, name: str, receiver: Automaton) -> bool:
        """Return whether an event may be sent while an automaton is active."""
        pieces = self._by_name.get(name, {}).items()
        return any(
            not _sends_at_once(piece, name, places) or self._reaches(piece, receiver)
            for piece, places in pieces
        )

    def _reaches(self, piece: Piece, receiver: Automaton) -> bool:
        if piece not in self._places:
            return True
        automaton, state, is_active = self._places[piece]
        owners, above = self._owners[receiver.id], self._owners[automaton]
        if automaton in owners:
            return is_active and owners[automaton] == state
        return all(above[each] == owners[each] for each in above.keys() & owners.keys())


def _owners_above(document: Document) -> dict[int, dict[int, int]]:
    """Return the automata above each automaton with the state that contains it, all by id."""
    owners = {
        child: (automaton.id, state.id) for automaton, state in document.states() for child in state.children
    }
    found: dict[int, dict[int, int]] = {}
    for automaton in document.automata:
        above: dict[int, int] = {}
        current = automaton.id
        while current in owners and owners[current][0] not in above:
            current, state = owners[current]
            above[current] = state
        found[automaton.id] = above
    return found


def _sends_at_once(piece: Piece, name: str, places: Collection[ast.AST]) -> bool:
    """Return whether a piece uses the name of an event only to send it, at `places`, at once."""
    nodes = all_nodes(piece.tree)
    return not any(
        isinstance(node, ast.Lambda | ast.FunctionDef | ast.AsyncFunctionDef)
        or (isinstance(node, ast.Constant) and node.value == name and node not in places)
        for node in nodes
    )


def _position(place: Location) -> tuple[int, int]:
    return place.line, place.column
