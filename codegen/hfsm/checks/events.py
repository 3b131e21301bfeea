"""Find events that are awaited but never sent, and events that nothing awaits.

An event reaches the automata that are active when it is sent, but no ghosts.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping

from ...diagnostics import Location, did_you_mean
from ..analysis import Access, Analysis, Piece
from ..code.text import all_nodes
from ..codes import Code
from ..document import Automaton, Document
from .report import Report, transition_label

__all__ = ["check_events"]


def check_events(analysis: Analysis, report: Report) -> None:
    """Compare the events that are awaited, sent and declared.

    Events that code sends through another name for the component count, too.
    """
    document = analysis.document
    has_own_send = "send" in analysis.defined  # the events that it sends are unknown
    sent: dict[str, Location] = {}
    for access in () if has_own_send else analysis.accesses:
        if (constant := _sent_name(access)) is not None:
            sent.setdefault(str(constant.value), access.piece.place(constant))
    names = {piece: frozenset(analysis.effects.of_piece(piece).events) for piece in analysis.pieces}
    otherwise = set[str]().union(*names.values())
    senders = _Senders(analysis, names)
    is_complete = analysis.is_complete and not has_own_send and not analysis.effects.unclear_sends
    declared = {event.name.strip(): report.place(event) for event in document.events}
    awaited: set[str] = set()
    for automaton in document.automata:
        for transition in automaton.transitions:
            name = transition.trigger.text.strip()
            if transition.type != "event" or not name:
                continue
            awaited.add(name)
            who = transition_label(transition)
            if is_complete and name not in {*sent, *otherwise, *declared}:
                message = f"{who} waits for the event `{name}`, which is neither sent nor declared"
                known = did_you_mean(name, {*sent, *declared})
                report.warning(
                    Code.UNSENT_EVENT, message, report.place(transition, transition.trigger), known
                )
            elif is_complete and name not in declared and not senders.reach(name, automaton):
                message = f"the event `{name}` is sent only while the automaton of {who} is a ghost"
                report.warning(Code.UNSENT_EVENT, message, report.place(transition, transition.trigger))
    for name, place in {**sent, **declared}.items():
        if name not in awaited:
            message = f"no transition waits for the event `{name}`"
            report.warning(Code.UNAWAITED_EVENT, message, place, did_you_mean(name, awaited))


class _Senders:
    """The pieces of code that send events, and whether they can run while an automaton is active."""

    def __init__(self, analysis: Analysis, names: Mapping[Piece, frozenset[str]]) -> None:
        self._by_name: dict[str, list[Piece]] = {}
        for piece, sent in names.items():
            for event in sent:
                self._by_name.setdefault(event, []).append(piece)
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
        return any(self._reaches(piece, name, receiver) for piece in self._by_name.get(name, ()))

    def _reaches(self, piece: Piece, name: str, receiver: Automaton) -> bool:
        if piece not in self._places or not _sends_at_once(piece, name):
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


def _sends_at_once(piece: Piece, name: str) -> bool:
    """Return whether a piece uses the name of an event only to send it at once."""
    nodes = all_nodes(piece.tree)
    if any(isinstance(node, ast.Lambda | ast.FunctionDef | ast.AsyncFunctionDef) for node in nodes):
        return False
    mentions = sum(isinstance(node, ast.Constant) and node.value == name for node in nodes)
    return mentions == sum(sent.value == name for sent in map(_sent_name, piece.accesses) if sent is not None)


def _sent_name(access: Access) -> ast.Constant | None:
    """Return the event that a use of the component sends as a constant, or None."""
    if access.path != ("send",) or access.call is None:
        return None
    keywords = [keyword.value for keyword in access.call.keywords if keyword.arg == "name"]
    name = next(iter([*access.call.args, *keywords]), None)
    return name if isinstance(name, ast.Constant) and isinstance(name.value, str) else None
