"""Find the place of each part of a document in SCXML, where automata are inside the states that own them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from ..document import NO_CHILD, Automaton, Document, State, Transition
from ..formats.xml_tree import XmlComment, XmlElement
from .own_elements import with_comments
from .vocabulary import delay_text

__all__ = ["Misfit", "PlacedAutomaton", "PlacedState", "PlacedTransition", "Placement", "place"]

_MAX_DEPTH: Final = 24
"""Levels of automata in a file, each of up to two elements, of which the reader takes 64."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedTransition:
    """A transition, its native element and the comments before that."""

    transition: Transition
    native: XmlElement
    comments: list[XmlComment]


@dataclass(slots=True, eq=False)
class PlacedState:
    """A state with its transitions, in the order in which they are tried, and its automata."""

    state: State
    native: XmlElement
    comments: list[XmlComment]
    transitions: list[PlacedTransition] = field(default_factory=list)
    automata: list[PlacedAutomaton] = field(default_factory=list)
    id: str = ""

    @property
    def resumes(self) -> bool:
        """Whether it has automata with states that go on where they were."""
        return self.state.history.text.strip() != "restart" and self.has_inside

    @property
    def has_inside(self) -> bool:
        """Whether there are elements of states inside its own."""
        return len(self.automata) > 1 or any(automaton.states for automaton in self.automata)


@dataclass(slots=True, eq=False)
class PlacedAutomaton:
    """An automaton with its states; transitions without a place are among its misfits."""

    automaton: Automaton
    native: XmlElement
    comments: list[XmlComment]
    states: list[PlacedState] = field(default_factory=list)
    misfits: list[PlacedTransition] = field(default_factory=list)
    id: str = ""

    @property
    def first(self) -> PlacedState | None:
        """The state in which it begins."""
        return next((state for state in self.states if state.state.initial), next(iter(self.states), None))

    def transitions(self) -> Iterator[PlacedTransition]:
        """Yield its transitions in the order in which they stand in SCXML, the misfits last."""
        for state in self.states:
            yield from state.transitions
        yield from self.misfits


@dataclass(frozen=True, slots=True)
class Misfit:
    """What has no place in SCXML, and why."""

    what: Automaton | Transition
    reason: str


@dataclass(slots=True)
class Placement:
    """The root with all inside it, the automata that have no place, and what has none at all."""

    root: PlacedAutomaton | None = None
    automata: list[PlacedAutomaton] = field(default_factory=list)
    lost: list[PlacedAutomaton] = field(default_factory=list)
    misfits: list[Misfit] = field(default_factory=list)


def place(document: Document, native: XmlElement) -> Placement:
    """Return where each part of a document stands in SCXML; `native` is the document as XML."""
    found = [item for item in with_comments(native) if item[1].tag == "SubAutomata"]
    elements = {id(automaton): item for automaton, item in zip(document.automata, found, strict=True)}
    placer = _Placer(document, elements)
    root = next((automaton for automaton in document.automata if automaton.father == NO_CHILD), None)
    if root is not None:
        placer.placement.root = placer.automaton(root, 1)
    for automaton in document.automata:
        if id(automaton) not in placer.placed:
            comments, element = elements[id(automaton)]
            placer.placement.lost.append(PlacedAutomaton(automaton, element, comments))
            placer.placement.misfits.append(Misfit(automaton, placer.reasons.get(id(automaton), _NO_OWNER)))
    return placer.placement


_NO_OWNER: Final = "no state with a place in SCXML owns it"


class _Placer:
    def __init__(self, document: Document, elements: dict[int, tuple[list[XmlComment], XmlElement]]) -> None:
        self._document = document
        self._elements = elements
        self.placement = Placement()
        self.placed: set[int] = set()
        """The identities of the automata that have a place; ids may repeat."""
        self._ids: set[int] = set()
        self.reasons: dict[int, str] = {}

    def automaton(self, automaton: Automaton, depth: int) -> PlacedAutomaton:
        comments, element = self._elements[id(automaton)]
        placed = PlacedAutomaton(automaton, element, comments)
        self.placed.add(id(automaton))
        self._ids.add(automaton.id)
        self.placement.automata.append(placed)
        parts = list(with_comments(element))
        states = [item for item in parts if item[1].tag == "state"]
        for state, (before, native) in zip(automaton.states, states, strict=True):
            placed.states.append(PlacedState(state, native, before))
        self._transitions(placed, [item for item in parts if item[1].tag == "transition"])
        for each in placed.states:
            each.automata = list(self._inside(automaton, each.state, depth))
        return placed

    def _inside(self, automaton: Automaton, state: State, depth: int) -> Iterator[PlacedAutomaton]:
        for child_id in state.children:
            child = self._document.automaton(child_id)
            if child is None or id(child) in self.placed or child.father != automaton.id:
                continue
            if child.id in self._ids:
                self.reasons[id(child)] = "another automaton has its id"
            elif state.final:
                self.reasons[id(child)] = "a final state has nothing inside it in SCXML"
            elif depth >= _MAX_DEPTH:
                self.reasons[id(child)] = f"it is more than {_MAX_DEPTH} levels deep"
            else:
                yield self.automaton(child, depth + 1)

    def _transitions(
        self, placed: PlacedAutomaton, elements: list[tuple[list[XmlComment], XmlElement]]
    ) -> None:
        automaton = placed.automaton
        items = {
            id(transition): PlacedTransition(transition, native, comments)
            for transition, (comments, native) in zip(automaton.transitions, elements, strict=True)
        }
        for transition in automaton.transitions:
            reason = _misfit(automaton, transition)
            if reason:
                placed.misfits.append(items.pop(id(transition)))
                self.placement.misfits.append(Misfit(transition, reason))
        seen: set[int] = set()
        for state in placed.states:
            if state.state.id not in seen:
                seen.add(state.state.id)
                outgoing = automaton.outgoing(state.state.id)
                state.transitions = [items[id(each)] for each in outgoing if id(each) in items]


def _misfit(automaton: Automaton, transition: Transition) -> str:
    """Return why a transition has no place in SCXML, blank when it has one."""
    origin = automaton.state(transition.origin)
    if origin is None:
        return "it leaves no state"
    if automaton.state(transition.destination) is None:
        return "it leads to no state"
    if origin.final:
        return "a final state has no transitions in SCXML"
    match transition.type:
        case "time":
            return "" if delay_text(transition.trigger.text) else "its time is no number of milliseconds"
        case "event":
            return "it names no event" if not transition.trigger.text else ""
        case "condition" | "finished":
            return ""
    return f"its type `{transition.type[:40]}` is unknown"
