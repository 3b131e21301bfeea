"""Find events that are waited for in vain, and events that nobody waits for.

An event reaches the automata that are active when it is sent, and no ghost.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ...diagnostics import Location, did_you_mean
from ..analysis import Access, Analysis, Piece
from ..codes import Code
from ..document import Automaton
from ..sends import sends_of, unclear_sends
from .report import Report, transition_label

__all__ = ["check_events"]


def check_events(analysis: Analysis, report: Report) -> None:
    """Compare the events that are awaited, sent and declared.

    What code sends by other names for the component counts, too.
    """
    document = analysis.document
    has_own_send = "send" in analysis.defined  # what that sends is its own affair
    sent = {} if has_own_send else _sent(analysis.accesses)
    names = {piece: sends_of(piece.tree).names for piece in analysis.pieces}
    otherwise = set[str]().union(*names.values())
    senders = _Senders(analysis, names)
    is_complete = analysis.is_complete and not has_own_send and not unclear_sends(analysis)
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
                message = f"{who} waits for the event `{name}`, which nothing sends or declares"
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


@dataclass(frozen=True)
class _Place:
    """Where a piece of code stands; its automata below are active while it runs if it is of a `stay`."""

    automaton: Automaton
    state: int
    is_stay: bool


class _Senders:
    """The pieces of code that send events, and whether they can while an automaton is active."""

    def __init__(self, analysis: Analysis, names: Mapping[Piece, frozenset[str]]) -> None:
        self._document = analysis.document
        self._by_name: dict[str, list[Piece]] = {}
        for piece, sent in names.items():
            for event in sent:
                self._by_name.setdefault(event, []).append(piece)
        self._places: dict[Piece, _Place] = {}
        for code in analysis.automata:
            stays, changes = [*code.code.items()], [*code.entry.items(), *code.exit.items()]
            changes += [
                (state, piece) for state, pieces in code.arguments.items() for piece in pieces.values()
            ]
            for transition in code.automaton.transitions:
                condition, fired = code.condition_of(transition), code.fired_by(transition)
                stays += [] if condition is None else [(transition.origin, condition)]
                changes += [] if fired is None else [(transition.origin, fired)]
            for is_stay, places in ((True, stays), (False, changes)):
                for state, piece in places:
                    self._places[piece] = _Place(code.automaton, state, is_stay)
        self._direct = Counter(
            (access.piece, name.value)
            for access in analysis.accesses
            if access.path == ("send",)
            and access.call is not None
            and isinstance(name := _name(access.call), ast.Constant)
        )
        self._above: dict[int, dict[int, int]] = {}

    def reach(self, name: str, receiver: Automaton) -> bool:
        """Return whether an event may be sent while an automaton is active, as far as can be seen."""
        return any(self._reaches(piece, name, receiver) for piece in self._by_name.get(name, ()))

    def _reaches(self, piece: Piece, name: str, receiver: Automaton) -> bool:
        place = self._places.get(piece)
        if place is None or not self._sends_at_once(piece, name):
            return True
        owners, above = self._owners(receiver), self._owners(place.automaton)
        if place.automaton.id in owners:
            return place.is_stay and owners[place.automaton.id] == place.state
        return all(above[each] == owners[each] for each in above.keys() & owners.keys())

    def _sends_at_once(self, piece: Piece, name: str) -> bool:
        """Return whether all that a piece does with the name of an event is to send it when it runs."""
        nodes = list(ast.walk(piece.tree))
        if any(isinstance(node, ast.Lambda | ast.FunctionDef | ast.AsyncFunctionDef) for node in nodes):
            return False
        mentions = sum(isinstance(node, ast.Constant) and node.value == name for node in nodes)
        return mentions == self._direct[piece, name]

    def _owners(self, automaton: Automaton) -> dict[int, int]:
        """Return the automata above one, by id, with the states that own the chain down to it."""
        if automaton.id not in self._above:
            found: dict[int, int] = {}
            each = automaton
            while (owner := self._document.owner(each)) is not None and each.father not in found:
                found[each.father] = owner.id
                father = self._document.automaton(each.father)
                assert father is not None, "it has the owner"
                each = father
            self._above[automaton.id] = found
        return self._above[automaton.id]


def _sent(found: Iterable[Access]) -> dict[str, Location]:
    """Return the events that code sends by `self`, with the first place of each."""
    sent: dict[str, Location] = {}
    for access in found:
        name = None if access.path != ("send",) or access.call is None else _name(access.call)
        if isinstance(name, ast.Constant) and isinstance(name.value, str):
            sent.setdefault(name.value, access.piece.place(name))
    return sent


def _name(call: ast.Call) -> ast.expr | None:
    if call.args:
        return call.args[0]
    return next((keyword.value for keyword in call.keywords if keyword.arg == "name"), None)
