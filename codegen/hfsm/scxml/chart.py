"""The states of an SCXML file as a tree, in which automata are the states inside another."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from ..formats.xml_tree import XmlComment, XmlElement
from .own_elements import native_element, with_comments
from .problems import Problems
from .qualified import QualifiedTree
from .vocabulary import INDEX

__all__ = ["Chart", "ChartAutomaton", "ChartState", "Edge"]

_STATES: Final = ("state", "parallel", "final")


@dataclass(slots=True, eq=False)
class Edge:
    """A transition between two states of one automaton, as the native format has it.

    `element` is the transition of SCXML from which it comes, `script` what its code comes from.
    """

    element: XmlElement
    destination: ChartState
    type: str
    trigger: str = ""
    guard: str = ""
    code: str = ""
    script: XmlElement | None = None
    native: XmlElement | None = None
    comments: list[XmlComment] = field(default_factory=list)
    index: int | None = None


@dataclass(slots=True, eq=False)
class ChartState:
    """A state; `native` is what our namespace says of it, `name` its id if that does not name it."""

    element: XmlElement
    automaton: ChartAutomaton
    name: str
    is_final: bool = False
    is_parallel: bool = False
    native: XmlElement | None = None
    comments: list[XmlComment] = field(default_factory=list)
    automata: list[ChartAutomaton] = field(default_factory=list)
    history: XmlElement | None = None
    edges: list[Edge] = field(default_factory=list)
    number: int = 0

    def way_up(self) -> Iterator[ChartState]:
        """Yield the state and all around it, from the inside."""
        state: ChartState | None = self
        while state is not None:
            yield state
            state = state.automaton.owner


@dataclass(slots=True, eq=False)
class ChartAutomaton:
    """States side by side, and the element of SCXML that holds them."""

    element: XmlElement
    owner: ChartState | None = None
    native: XmlElement | None = None
    comments: list[XmlComment] = field(default_factory=list)
    states: list[ChartState] = field(default_factory=list)
    holds_its_state: bool = False
    """Whether the element is that of its one state: a region with transitions or code of its own."""
    first: ChartState | None = None
    index: int | None = None
    number: int = 0


class Chart:
    """All automata of a file, the root first, each before those below it."""

    def __init__(self, root: XmlElement, tree: QualifiedTree, problems: Problems) -> None:
        self.tree = tree
        self.automata: list[ChartAutomaton] = []
        self.ids: dict[str, ChartState] = {}
        """The states by their ids; histories and regions stand for the states that have them."""
        self.histories: dict[str, XmlElement] = {}
        self.regions: dict[str, ChartAutomaton] = {}
        self.stray_comments: dict[XmlElement, list[XmlComment]] = {}
        """Comments that belong to no element of the native format, by the element that they stand in."""
        self._problems = problems
        self._origins: dict[XmlElement, XmlElement] = {}
        self.root = ChartAutomaton(root)
        self._fill(self.root)

    def _fill(self, automaton: ChartAutomaton) -> None:
        """Read the states inside the element of an automaton."""
        self.automata.append(automaton)
        own = self._own_of(automaton.element, "SubAutomata")
        if own is not None:
            automaton.comments, automaton.native, automaton.index = own
        for comments, element in self._states_in(automaton.element):
            automaton.states.append(self._state(element, automaton, comments))
        for state in automaton.states:
            self._fill_state(state)

    def _fill_state(self, state: ChartState) -> None:
        if state.is_parallel:
            for comments, region in self._states_in(state.element):
                self._region(state, region, comments)
        elif not state.is_final and (
            any(True for _ in self._states_in(state.element))
            or self.tree.own_inside(state.element, "SubAutomata") is not None
        ):
            inner = ChartAutomaton(state.element, state)
            state.automata.append(inner)
            self._fill(inner)

    def _region(self, owner: ChartState, region: XmlElement, comments: list[XmlComment]) -> None:
        inner = ChartAutomaton(region, owner)
        owner.automata.append(inner)
        if self._is_mere_region(region):
            self._fill(inner)
            name = region.attributes.get("id", "")
            if inner.native is None:
                # Automata have no names: a comment keeps it.
                inner.comments = [*comments, *([XmlComment(f" {name} ")] if _is_comment(name) else [])]
            self._add_id(name, owner, region)
            self.regions[name] = inner
            return
        self.automata.append(inner)
        inner.holds_its_state = True
        state = self._state(region, inner, comments)
        inner.states.append(state)
        self._fill_state(state)

    def _is_mere_region(self, region: XmlElement) -> bool:
        """Return whether a region has nothing of its own but the states inside it."""
        if self.tree.scxml(region) != "state" or self.tree.own_inside(region, "state") is not None:
            return False
        if self.tree.own_inside(region, "SubAutomata") is not None:
            return True
        names = {self.tree.scxml(child) for child in self.tree.inside(region)}
        return bool(names & set(_STATES)) and names <= {*_STATES, "initial", "datamodel"}

    def _state(
        self, element: XmlElement, automaton: ChartAutomaton, comments: list[XmlComment]
    ) -> ChartState:
        kind = self.tree.scxml(element)
        name = element.attributes.get("id", "")
        state = ChartState(element, automaton, name, kind == "final", kind == "parallel", comments=comments)
        own = self._own_of(element, "state")
        if own is not None:
            strays, state.native, _ = own
            self.stray_comments.setdefault(element, []).extend(strays)
        self._add_id(name, state, element)
        for history in self.tree.inside(element, "history"):
            self._add_id(history.attributes.get("id", ""), state, history)
            if state.history is None:
                state.history = history
                self.histories[history.attributes.get("id", "")] = history
            else:
                message = "a second history of a state: its automata have one, the first"
                self._problems.approximate(history, message)
        return state

    def _add_id(self, id: str, state: ChartState, element: XmlElement) -> None:
        if id and id in self.ids:
            self._problems.invalid(element, f"a second element has the id `{id[:60]}`")
        elif id:
            self.ids[id] = state

    def _own_of(
        self, element: XmlElement, name: str
    ) -> tuple[list[XmlComment], XmlElement, int | None] | None:
        """Return what our namespace has for an element, with the comments before it and its place."""
        for comments, child in with_comments(element):
            if self.tree.own(child) == name:
                native = self.native(child)
                return comments, native, self.place_of(native)
        return None

    def native(self, own: XmlElement) -> XmlElement:
        """Return the native element that an element of our namespace stands for."""
        return native_element(own, self._origins)

    def place_of(self, native: XmlElement) -> int | None:
        """Return the place in the native document that an element of our namespace told, or None."""
        text = self.tree.own_attribute(self._origins[native], INDEX) or ""
        return int(text) if text.isascii() and text.isdigit() and len(text) < 10 else None

    def _states_in(self, element: XmlElement) -> Iterator[tuple[list[XmlComment], XmlElement]]:
        return (item for item in with_comments(element) if self.tree.scxml(item[1]) in _STATES)


def _is_comment(text: str) -> bool:
    return bool(text) and "--" not in text
