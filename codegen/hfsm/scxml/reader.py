"""Read SCXML into the model of a document.

A file that was written here, and whose chart nobody has changed since, gives the document that it was. Of any
other file what can be said here is carried, and the rest is reported.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics

from ..codes import Code
from ..document import (
    NO_CHILD,
    Automaton,
    Document,
    Event,
    Parameter,
    State,
    Text,
    Transition,
)
from ..formats.reader import parse_document
from ..formats.xml_tree import XmlElement, parse_xml, read_bytes
from .chart import STATES, Chart, ChartAutomaton, ChartState
from .content import OTHER, CodeReader, Findings, everywhere, inside, resolve_namespaces
from .vocabulary import OWN_PREFIX, SCXML_NAMESPACE, is_name
from .writer import scxml_text

__all__ = ["is_scxml", "parse_scxml", "read_scxml"]

_ROOT: Final = "scxml"
_START: Final = re.compile(
    rb"\A(?:\xef\xbb\xbf)?(?:\s|<\?.*?\?>|<!--.*?-->)*<(?:[\w.-]+:)?scxml[\s/>]", re.DOTALL
)
_STATE_PARTS: Final = frozenset(
    (*STATES, "onentry", "onexit", "transition", "initial", "history", "datamodel")
)
_PARTS: Final = {
    _ROOT: frozenset((*STATES, "datamodel", "script", "initial")),
    "state": _STATE_PARTS,
    "parallel": _STATE_PARTS,
    "final": frozenset(("onentry", "onexit", "transition")),
}
_COLUMNS: Final = 4
_ORIGIN: Final = (120.0, 160.0)
_STEP: Final = (300.0, 200.0)
"""Where states are put on the canvas, in pixels."""


def is_scxml(head: bytes) -> bool:
    """Return whether a file that begins so has the root of SCXML."""
    return _START.match(head) is not None


def read_scxml(path: Path, diagnostics: Diagnostics) -> Document | None:
    """Return the document in a file of SCXML, or None after errors were reported."""
    content = read_bytes(path, diagnostics)
    return None if content is None else parse_scxml(content, path, diagnostics)


def parse_scxml(content: bytes | str, path: Path, diagnostics: Diagnostics) -> Document | None:
    """Return the document in SCXML, or None after errors were reported; `path` is for the messages."""
    parsed = parse_xml(content.encode() if isinstance(content, str) else content, path, diagnostics)
    if parsed is None:
        return None
    root, comments = parsed
    findings = Findings(path, diagnostics)
    has_own = resolve_namespaces(root)
    if root.tag != _ROOT:
        name = root.tag.removeprefix(OTHER)[:60]
        findings.invalid(root, f"`{name}` is not the root of SCXML: it is `{_ROOT}`, of {SCXML_NAMESPACE}")
        return None
    element = next(inside(root, f"{OWN_PREFIX}:document"), None)
    if element is not None:
        native = _native(element, path, findings)
        if native is None:
            return None
        if _is_chart_of(native, root):
            return native
        findings.lost(
            element,
            "the chart was changed since it was written from this document: the chart alone is read, without "
            "what SCXML cannot say, such as positions and code that runs in every cycle",
        )
    found = _ChartReader(root, findings, has_own=has_own).document()
    return None if found is None else replace(found, comments=tuple(comments))


def _is_chart_of(native: Document, root: XmlElement) -> bool:
    """Return whether the chart in a file is the one that is written of a document."""
    written = parse_xml(scxml_text(native).encode(), Path(), Diagnostics())
    assert written is not None, "what was written can be read"
    resolve_namespaces(written[0])
    charts = [
        _ChartReader(each, Findings(Path(), Diagnostics()), has_own=True).document()
        for each in (root, written[0])
    ]
    return charts[0] == charts[1]


def _native(element: XmlElement, path: Path, findings: Findings) -> Document | None:
    """Return the native document in an element, or None after an error was reported."""
    found = Diagnostics()
    # Empty lines before it give its parts their lines in the file.
    native = parse_document("\n" * (element.text_line - 1) + element.text, path, found)
    if native is None:
        first = found.errors[0]
        line = f"line {first.location.line}: " if first.location.line else ""
        findings.invalid(element, f"the document inside cannot be read: {line}{first.message}")
    return native


class _ChartReader:
    """Makes a document of the chart in a file."""

    def __init__(self, root: XmlElement, findings: Findings, *, has_own: bool) -> None:
        self._root = root
        self._findings = findings
        self._code = CodeReader(root.attributes.get("datamodel", ""), findings, has_own=has_own)
        self._chart = Chart(root, self._code, findings)
        self._data: list[tuple[str, XmlElement, ChartAutomaton]] = []

    def document(self) -> Document | None:
        """Return the document, or None after errors were reported."""
        for number, automaton in enumerate(self._chart.automata, 1):
            automaton.number = number
            for place, state in enumerate(automaton.states, 1):
                state.number = place
        self._report_rest()
        element = self._root
        automata = tuple(self._automaton(each) for each in self._chart.automata)
        sent = {
            self._code.event(each.attributes.get("event", ""))
            for each in everywhere(element, "raise", "send")
        }
        events = [name for name in dict.fromkeys(self._chart.events) if name not in sent]
        document = Document(
            description=Text(element.attributes.get("name", ""), element.line, element.column),
            language=Text(self._code.language, element.line, element.column),
            parameters=tuple(self._parameters()),
            events=tuple(Event(name=name) for name in events),
            automata=automata,
        )
        self._check_scopes(document)
        return None if self._findings.failed else document

    def _automaton(self, automaton: ChartAutomaton) -> Automaton:
        element = automaton.element
        states = tuple(self._state(each, place) for place, each in enumerate(automaton.states))
        father = automaton.owner.automaton.number if automaton.owner is not None else NO_CHILD
        return Automaton(
            id=automaton.number,
            father=father,
            states=states,
            transitions=tuple(self._transitions(automaton, states)),
            variables=self._variables(automaton),
            comments=automaton.comments,
            line=element.line,
            column=element.column,
        )

    def _state(self, state: ChartState, place: int) -> State:
        element = state.element
        waits = element.tag == "transition"  # it was added here
        is_parallel = element.tag == "parallel"
        has_inside = is_parallel or any(each.states for each in state.automata)
        return State(
            id=state.number,
            name=state.name,
            initial=state is state.automaton.first,
            final=state.is_final,
            x=_ORIGIN[0] + _STEP[0] * (place % _COLUMNS),
            y=_ORIGIN[1] + _STEP[1] * (place // _COLUMNS),
            children=tuple(each.number for each in state.automata),
            history=Text("restart" if has_inside and state.history is None else ""),
            entry=Text()
            if waits
            else self._code.code(list(inside(element, "onentry")), self._chart.timer_elements),
            exit=Text()
            if waits
            else self._code.code(list(inside(element, "onexit")), self._chart.timer_elements),
            comments=state.comments,
            line=element.line,
            column=element.column,
        )

    def _transitions(self, automaton: ChartAutomaton, states: Sequence[State]) -> Iterator[Transition]:
        numbers = count(1)
        places = dict(zip(automaton.states, states, strict=True))
        for state in automaton.states:
            for edge in state.edges:
                element, ends = edge.source, (places[state], places[edge.destination])
                yield Transition(
                    id=next(numbers),
                    x=(ends[0].x + ends[1].x) / 2,
                    y=(ends[0].y + ends[1].y) / 2,
                    origin=state.number,
                    destination=edge.destination.number,
                    type=edge.type,
                    trigger=Text(edge.trigger, element.line, element.column),
                    guard=Text(edge.guard, element.line, element.column),
                    code=edge.code,
                    comments=edge.comments,
                    line=element.line,
                    column=element.column,
                )

    def _variables(self, automaton: ChartAutomaton) -> Text:
        """Return the data of an automaton as variables."""
        holders = [] if automaton.is_region else [automaton.element]
        inner = {each.element for state in automaton.states for each in state.automata}
        holders += [state.element for state in automaton.states if state.element not in inner]
        lines: list[str] = []
        first: XmlElement | None = None
        for holder in holders:
            for datamodel in inside(holder, "datamodel"):
                for data in inside(datamodel, "data"):
                    if f"{OWN_PREFIX}:type" in data.attributes and automaton.owner is None:
                        continue  # a parameter
                    name = data.attributes.get("id", "")
                    if not is_name(name) or "src" in data.attributes:
                        self._findings.lost(data, f"the data `{name[:60]}` is no variable of Python")
                        continue
                    text = data.attributes.get("expr", data.text)
                    value = self._code.expression(data, text) if text.strip() else "None"
                    self._data.append((name, data, automaton))
                    lines.append(f"{name} = {value}")
                    first = first or data
        for script in inside(automaton.element, "script") if automaton.owner is None else ():
            lines += self._code.script(script)
            first = first or script
        return Text("\n".join(lines), first.line, first.column) if first is not None else Text()

    def _parameters(self) -> Iterator[Parameter]:
        for datamodel in inside(self._root, "datamodel"):
            for data in inside(datamodel, "data"):
                type_name = data.attributes.get(f"{OWN_PREFIX}:type")
                if type_name is not None:
                    yield Parameter(
                        name=data.attributes.get("id", ""),
                        type=Text(type_name, data.line, data.column),
                        default=Text(data.attributes.get("expr", ""), data.line, data.column),
                        description=Text(data.attributes.get(f"{OWN_PREFIX}:description", "")),
                        line=data.line,
                        column=data.column,
                    )

    # What is reported.

    def _report_rest(self) -> None:
        """Report elements of which nothing here is made."""
        others: set[str] = set()
        elements = [self._root]
        while elements:
            element = elements.pop()
            known = _PARTS.get(element.tag)
            for child in element.elements():
                name = child.tag.removeprefix(OTHER)
                local = name.rpartition(":")[2]
                if child.tag.startswith(OTHER):
                    if local not in others:
                        message = f"`{name[:60]}` belongs to another program and is not carried"
                        self._findings.note(Code.SCXML_FOREIGN, child, message)
                    others.add(local)
                elif child.tag.startswith(f"{OWN_PREFIX}:"):
                    continue
                elif known is not None and name not in known:
                    message = f"`{name[:60]}` is not carried: there is nothing like it here"
                    self._findings.lost(child, message)
                else:
                    elements.append(child)

    def _check_scopes(self, document: Document) -> None:
        """Report data that code elsewhere uses: here a variable belongs to one automaton."""
        texts = {automaton.id: "\n".join(_code_of(automaton)) for automaton in document.automata}
        for name, data, automaton in self._data:
            word = re.compile(rf"\b{re.escape(name)}\b")
            users = [
                other for other, text in texts.items() if other != automaton.number and word.search(text)
            ]
            if users:
                message = (
                    f"`{name[:60]}` is a variable of automaton {automaton.number} alone here, and code of "
                    f"automaton {users[0]} uses it: let it be `self.{name[:60]}`"
                )
                self._findings.approximate(data, message)


def _code_of(automaton: Automaton) -> Iterator[str]:
    for state in automaton.states:
        yield from (state.entry.text, state.exit.text)
    for transition in automaton.transitions:
        yield from (transition.guard.text, transition.code.text)
        if transition.type == "condition":
            yield transition.trigger.text
