"""Make the XML of a native document of the states and transitions that were found in SCXML."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import count
from typing import Final

from ..document import NO_CHILD
from ..formats.dialects import ROOT_TAGS
from ..formats.xml_tree import XmlComment, XmlElement
from .chart import Chart, ChartAutomaton, ChartState, Edge
from .code import CodeReader
from .data import is_name
from .numbering import Placed, give_ids, id_of, in_order
from .own_elements import set_leaf, with_comments
from .problems import Problems
from .timers import Timers
from .vocabulary import NEVER, delay_text, milliseconds_text

__all__ = ["Assembly"]

_COLUMNS: Final = 4
_ORIGIN: Final = (120.0, 160.0)
_STEP: Final = (300.0, 200.0)
"""Where states without a place on the canvas are put, in pixels."""


class Assembly:
    """Makes a document of a chart; `data` are the variables that it found, with their automata."""

    def __init__(self, chart: Chart, code: CodeReader, timers: Timers, problems: Problems) -> None:
        self._chart = chart
        self._tree = chart.tree
        self._code = code
        self._timers = timers
        self._problems = problems
        self.data: list[tuple[str, XmlElement, ChartAutomaton]] = []

    def document(self, events: Sequence[str]) -> XmlElement:
        """Return the native document; `events` are declared where the file is not one of ours."""
        element = self._chart.root.element
        root = self._own_root()
        lost = self._taken(root, "SubAutomata")
        parameters = list(self._parameters())
        self._number(lost)
        first = self._chart.root
        has_root = first.states or first.native is not None or root is None
        placed = self._chart.automata if has_root else []
        automata = [(each.index, each.comments, self._automaton(each)) for each in placed]
        ordered: list[XmlElement | XmlComment] = []
        for comments, automaton in in_order([*automata, *lost]):
            ordered += [*comments, automaton]
        if root is None:
            root = XmlElement(ROOT_TAGS[0], {}, element.line, element.column)
            set_leaf(root, "description", element.attributes.get("name", ""), element)
            if events:
                root.children.append(_list("events", (_event(name, element) for name in events), element))
        if parameters:
            known = next((child for child in root.elements() if child.tag == "parameters"), None)
            if known is None:
                root.children.insert(0, _list("parameters", parameters, element))
            else:
                known.children += parameters
        if self._code.language:
            set_leaf(root, "language", self._code.language, element)
        root.children[:0] = ordered
        root.children += self._chart.stray_comments.get(element, [])
        return root

    def _own_root(self) -> XmlElement | None:
        for tag in ROOT_TAGS:
            own = self._tree.own_inside(self._chart.root.element, tag)
            if own is not None:
                return self._chart.native(own)
        return None

    def _taken(self, parent: XmlElement | None, tag: str) -> list[Placed]:
        """Take the elements with a tag out of a native element, with the comments before them."""
        found = []
        for comments, child in list(with_comments(parent)) if parent is not None else []:
            if child.tag == tag and parent is not None:
                taken = {id(each) for each in (*comments, child)}
                parent.children = [each for each in parent.children if id(each) not in taken]
                found.append((self._chart.place_of(child), comments, child))
        return found

    # Numbers.

    def _number(self, lost: Iterable[Placed]) -> None:
        taken = {id_of(element) for _, _, element in lost}
        give_ids(self._chart.automata, taken, self._chart.automata)
        for automaton in self._chart.automata:
            used = {edge.destination for state in automaton.states for edge in state.edges}
            used |= {state for state in automaton.states if state.edges}
            give_ids(automaton.states, set(), used)

    # Automata.

    def _automaton(self, automaton: ChartAutomaton) -> XmlElement:
        native = automaton.native or _new("SubAutomata", automaton.element)
        native.attributes["id"] = str(automaton.number)
        native.attributes["idFather"] = str(
            automaton.owner.automaton.number if automaton.owner is not None else NO_CHILD
        )
        misfits = self._taken(native, "transition")
        self._variables(automaton, native)
        self._set_initial(automaton)
        parts: list[XmlElement | XmlComment] = []
        for place, state in enumerate(automaton.states):
            parts += [*state.comments, self._state(state, place)]
        transitions = self._transitions(automaton)
        for comments, transition in in_order([*transitions, *misfits]):
            parts += [*comments, transition]
        native.children[:0] = parts
        return native

    def _variables(self, automaton: ChartAutomaton, native: XmlElement) -> None:
        holders = [] if automaton.holds_its_state else [automaton.element]
        inner = {each.element for state in automaton.states for each in state.automata}
        holders += [state.element for state in automaton.states if state.element not in inner]
        lines: list[str] = []
        source = automaton.element
        for holder in holders:
            for datamodel in self._tree.inside(holder, "datamodel"):
                for data in self._tree.inside(datamodel, "data"):
                    if self._tree.own_attribute(data, "type") is None or automaton.owner is not None:
                        lines += self._datum(data, automaton)
                        source = data
        if automaton.owner is None:
            for script in self._tree.inside(automaton.element, "script"):
                lines += self._code.script(script)
                source = script
        if lines:
            before = next((leaf.text for leaf in native.elements() if leaf.tag == "variables"), "")
            set_leaf(native, "variables", "\n".join([before, *lines] if before else lines), source)

    def _datum(self, data: XmlElement, automaton: ChartAutomaton) -> Iterator[str]:
        name = data.attributes.get("id", "")
        if not is_name(name) or "src" in data.attributes:
            self._problems.lost(data, f"the data `{name[:60]}` is no variable of Python")
            return
        text = data.attributes.get("expr", data.text)
        value = self._code.expression(data, text) if text.strip() else "None"
        self.data.append((name, data, automaton))
        yield f"{name} = {value}"

    def _parameters(self) -> Iterator[XmlElement]:
        for datamodel in self._tree.inside(self._chart.root.element, "datamodel"):
            for data in self._tree.inside(datamodel, "data"):
                type_name = self._tree.own_attribute(data, "type")
                if type_name is not None:
                    parameter = _new("parameter", data)
                    set_leaf(parameter, "name", data.attributes.get("id", ""), data)
                    set_leaf(parameter, "type", type_name, data)
                    set_leaf(parameter, "default", data.attributes.get("expr", ""), data)
                    description = self._tree.own_attribute(data, "description") or ""
                    set_leaf(parameter, "description", description, data)
                    yield parameter

    def _set_initial(self, automaton: ChartAutomaton) -> None:
        """Mark the first state; where our namespace means the same its marks stay as they are."""
        natives = [state.native for state in automaton.states]
        marks = [native is not None and _is_true(native.attributes.get("initial")) for native in natives]
        marked = next(
            (state for state, mark in zip(automaton.states, marks, strict=True) if mark),
            next(iter(automaton.states), None),
        )
        is_ours = None not in natives
        for state in automaton.states:
            if not is_ours or marked is not automaton.first:
                native = state.native = state.native or _new("state", state.element)
                native.attributes["initial"] = "true" if state is automaton.first else "false"

    # States.

    def _state(self, state: ChartState, place: int) -> XmlElement:
        native = state.native
        assert native is not None, "it was made with the marks of first states"
        native.attributes["id"] = str(state.number)
        element, tree = state.element, self._tree
        leaves = {leaf.tag: leaf for leaf in native.elements()}
        if "name" not in leaves:
            set_leaf(native, "name", state.name, element)
        if not leaves:
            set_leaf(native, "posx", str(_ORIGIN[0] + _STEP[0] * (place % _COLUMNS)), element)
            set_leaf(native, "posy", str(_ORIGIN[1] + _STEP[1] * (place // _COLUMNS)), element)
        if state.is_final or "final" in leaves:
            set_leaf(native, "final", "true" if state.is_final else "false", element)
        has_inside = state.is_parallel or any(automaton.states for automaton in state.automata)
        written = leaves["history"].text if "history" in leaves else ""
        if has_inside and ("history" not in leaves or (written == "restart") != (state.history is None)):
            set_leaf(native, "history", "" if state.history is not None else "restart", element)
        for tag, holder in (("entry", "onentry"), ("exit", "onexit")):
            code, script = self._code.of(list(tree.inside(element, holder)), self._timers.consumed)
            set_leaf(native, tag, code, script or element)
        self._set_children(state, native)
        native.children += self._chart.stray_comments.get(element, [])
        return native

    def _set_children(self, state: ChartState, native: XmlElement) -> None:
        placed = [automaton.number for automaton in state.automata]
        known = [
            int(leaf.text)
            for leaf in native.elements()
            if leaf.tag in ("idSubautomataSon", "child") and leaf.text.strip().isdecimal()
        ]
        known = [child for child in known if child != NO_CHILD]
        children = known if set(placed) <= set(known) else placed
        native.children = [
            child for child in native.children if isinstance(child, XmlComment) or child.tag != "child"
        ]
        further = [_new("child", state.element, str(child)) for child in children[1:]]
        native.children[:0] = further
        if children or any(leaf.tag == "idSubautomataSon" for leaf in native.elements()):
            set_leaf(native, "idSubautomataSon", str(children[0] if children else NO_CHILD), state.element)

    # Transitions.

    def _transitions(self, automaton: ChartAutomaton) -> list[Placed]:
        edges = [(state, edge) for state in automaton.states for edge in state.edges]
        known = [id_of(edge.native) for _, edge in edges]
        free = (number for number in count(1) if number not in known)
        found = []
        for (state, edge), own_id in zip(edges, known, strict=True):
            native = edge.native or _new("transition", edge.element)
            native.attributes["id"] = str(own_id if own_id is not None else next(free))
            self._set_transition(native, state, edge)
            edge.native = native
            found.append((edge.index, edge.comments, native))
        return found

    def _set_transition(self, native: XmlElement, state: ChartState, edge: Edge) -> None:
        element = edge.element
        leaves = {leaf.tag: leaf for leaf in native.elements()}
        if edge.native is None and state.native is not None and edge.destination.native is not None:
            ends = (state.native, edge.destination.native)
            for tag in ("posx", "posy"):
                set_leaf(native, tag, str(sum(_number(end, tag) for end in ends) / 2), element)
        set_leaf(native, "origin", str(state.number), element)
        set_leaf(native, "destiny", str(edge.destination.number), element)
        set_leaf(native, "transcode", edge.code, edge.script or element)
        written = leaves["guard"].text if "guard" in leaves else ""
        if edge.type != "condition" and (edge.guard.strip() or written.strip()):
            set_leaf(native, "guard", edge.guard, element)
        trigger = leaves.get("trans")
        is_same = trigger is not None and trigger.attributes.get("type") == edge.type
        text = (
            trigger.text if trigger is not None and is_same and _agrees(trigger.text, edge) else edge.trigger
        )
        set_leaf(native, "trans", text, element, type=edge.type)


def _agrees(written: str, edge: Edge) -> bool:
    """Return whether a trigger of our namespace is what SCXML says in its own way."""
    match edge.type:
        case "time":
            delay = delay_text(written)
            read = milliseconds_text(delay) if delay is not None else None
            return read is not None and read[0] == edge.trigger
        case "condition":
            return edge.trigger in (NEVER, NEVER.lower())
    return edge.type == "finished"


def _new(tag: str, source: XmlElement, text: str = "") -> XmlElement:
    made = XmlElement(tag, {}, source.line, source.column, text, source.line, source.column)
    made.head = text
    return made


def _list(tag: str, items: Iterable[XmlElement], source: XmlElement) -> XmlElement:
    made = _new(tag, source)
    made.children += items
    return made


def _event(name: str, source: XmlElement) -> XmlElement:
    return _list("event", [_new("name", source, name)], source)


def _is_true(text: str | None) -> bool:
    return (text or "").strip().lower() in ("true", "1")


def _number(native: XmlElement, tag: str) -> float:
    text = next((leaf.text for leaf in native.elements() if leaf.tag == tag), "")
    try:
        number = float(text)
    except ValueError:
        return 0.0
    return number if math.isfinite(number) else 0.0
