"""Write a document as SCXML, the W3C's language of state charts.

What SCXML can say stands there in its own words. In front of it the whole native document stands in an
element of our namespace, so that the reader returns the same document.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics, Location

from ..code.language import is_foreign
from ..codes import Code
from ..document import NO_CHILD, Automaton, Comment, Document, Node, Parameter, State, Text, Transition
from ..formats.writer import INDENT, attributes_text, escaped, write_document
from .vocabulary import (
    NEVER,
    OWN_NAMESPACE,
    OWN_PREFIX,
    SCXML_NAMESPACE,
    delay_text,
    encode_event,
    expression_of,
    identifier,
    is_name,
)

__all__ = ["scxml_text", "write_scxml"]

_MAX_DEPTH: Final = 24
"""Levels of automata in a file, each of up to two elements, of which the reader takes 64."""

_DATAMODELS: Final = {"c++": "cplusplus"}
_ASSIGNMENT: Final = re.compile(r"([A-Za-z_][A-Za-z_0-9]*) = (\S.*)")
_DOT: Final = re.compile(r"\.")
_Attributes = Sequence[tuple[str, str]]


@dataclass(slots=True, eq=False)
class _State:
    """A state with its place in SCXML."""

    state: State
    id: str = ""
    transitions: list[Transition] = field(default_factory=list)
    automata: list[_Automaton] = field(default_factory=list)
    history: str = ""
    """The id of its history, blank where what is inside restarts."""


@dataclass(slots=True, eq=False)
class _Automaton:
    automaton: Automaton
    id: str = ""
    states: list[_State] = field(default_factory=list)

    @property
    def first(self) -> _State | None:
        """The state in which it begins."""
        return next((each for each in self.states if each.state.initial), next(iter(self.states), None))

    def state(self, id: int) -> _State:
        """Return the first state with this id."""
        return next(each for each in self.states if each.state.id == id)


def write_scxml(document: Document, path: Path, diagnostics: Diagnostics) -> str:
    """Return a document as SCXML, and report what other programs do not see of it.

    `path` is where the document lies. Raises DocumentNotWritableError.
    """
    writer = _Writer(document)
    text = writer.text()
    first_lines: dict[str, int] = {}
    for kind, line in _unsaid(document):
        first_lines.setdefault(kind, line)
    for kind, line in first_lines.items():
        message = f"SCXML has no word for {kind}: it is kept, and other programs do not see it"
        diagnostics.note(Code.SCXML_NO_WORD, message, Location(path, line))
    for node, name, reason in writer.misfits:
        message = f"{name} has no place in SCXML, and other programs do not see it: {reason}"
        diagnostics.warning(Code.SCXML_NO_PLACE, message, Location(path, node.line, max(1, node.column)))
    if writer.root is None or not writer.root.states:
        message = "there is no state, of which SCXML wants one: other programs may refuse the file"
        diagnostics.warning(Code.SCXML_NO_PLACE, message, Location(path))
    return text


def scxml_text(document: Document) -> str:
    """Return a document as SCXML. Raises DocumentNotWritableError."""
    return _Writer(document).text()


class _Writer:
    def __init__(self, document: Document) -> None:
        self._document = document
        self._is_python = not is_foreign(document)
        self._lines: list[str] = ['<?xml version="1.0" encoding="UTF-8"?>']
        self._depth = 0
        self._used: set[str] = set()
        """The ids of the file."""
        self.misfits: list[tuple[Node, str, str]] = []
        """What has no place in SCXML, its name, and why."""
        self._by_id = {each.id: each for each in reversed(document.automata)}
        self._placed: dict[int, _Automaton] = {}
        self._placed_ids: set[int] = set()
        self.root: _Automaton | None = None
        root = next((each for each in document.automata if each.father == NO_CHILD), None)
        reasons: dict[int, str] = {}
        if root is not None:
            self.root = self._place(root, 1, reasons)
        for automaton in document.automata:
            if id(automaton) not in self._placed:
                reason = reasons.get(id(automaton), "no state with a place in SCXML owns it")
                self.misfits.append((automaton, f"automaton {automaton.id}", reason))
        self._name_parts()
        self._events = self._encoded_events()

    # Where the parts stand, and what they are called.

    def _place(self, automaton: Automaton, depth: int, reasons: dict[int, str]) -> _Automaton:
        placed = _Automaton(automaton)
        self._placed[id(automaton)] = placed
        self._placed_ids.add(automaton.id)
        fitting: set[int] = set()
        for transition in automaton.transitions:
            reason = _why_no_place(automaton, transition)
            if reason:
                self.misfits.append((transition, f"transition {transition.id}", reason))
            else:
                fitting.add(id(transition))
        outgoing = automaton.all_outgoing()
        for state in automaton.states:
            leaving = outgoing.pop(state.id, ())
            found = [each for each in leaving if id(each) in fitting]
            placed.states.append(_State(state, transitions=found))
        for each in placed.states:
            each.automata = list(self._place_inside(automaton, each.state, depth, reasons))
        return placed

    def _place_inside(
        self, automaton: Automaton, state: State, depth: int, reasons: dict[int, str]
    ) -> Iterator[_Automaton]:
        for number in state.children:
            child = self._by_id.get(number)
            if child is None or id(child) in self._placed or child.father != automaton.id:
                continue
            if child.id in self._placed_ids:
                reasons[id(child)] = "another automaton has its id"
            elif state.final:
                reasons[id(child)] = "a final state has nothing inside it in SCXML"
            elif depth >= _MAX_DEPTH:
                reasons[id(child)] = f"it is more than {_MAX_DEPTH} levels deep"
            else:
                yield self._place(child, depth + 1, reasons)

    def _name_parts(self) -> None:
        for automaton in self._placed.values():
            for state in automaton.states:
                state.id = self._new_id(state.state.name)
        for automaton in self._placed.values():
            for state in automaton.states:
                inside = state.automata
                if len(inside) > 1:
                    for region in inside:
                        region.id = self._new_id(f"{state.id}_{region.automaton.id}")
                has_states = len(inside) > 1 or any(each.states for each in inside)
                if has_states and state.state.history.text.strip() != "restart":
                    state.history = self._new_id(f"{state.id}_history")

    def _new_id(self, text: str) -> str:
        base = identifier(text, "state")
        found, number = base, 1
        while found in self._used:
            number += 1
            found = f"{base}_{number}"
        self._used.add(found)
        return found

    def _encoded_events(self) -> dict[str, str]:
        """Return the names of events in SCXML, where `ball` matches `ball.red`, too."""
        transitions = [
            each for automaton in self._placed.values() for each in automaton.automaton.transitions
        ]
        used = {each.trigger.text for each in transitions if each.type == "event"}
        known = used | {event.name for event in self._document.events}
        return {
            name: encode_event(name, dots=any(name[: dot.start()] in known for dot in _DOT.finditer(name)))
            for name in used
        }

    # Elements.

    def text(self) -> str:
        """Return the file."""
        self._comments(self._document.comments)
        language = self._document.language.text.strip().lower()
        datamodel = "python" if self._is_python else _DATAMODELS.get(language) or identifier(language, "x")
        attributes = [("xmlns", SCXML_NAMESPACE), (f"xmlns:{OWN_PREFIX}", OWN_NAMESPACE)]
        attributes += [("version", "1.0"), ("datamodel", datamodel)]
        if self.root is not None:
            attributes += self._initial(self.root)
        self._open("scxml", attributes)
        # A CDATA section ends with its first `]]>`.
        native = write_document(self._document).partition("\n")[2].replace("]]>", "]]]]><![CDATA[>")
        self._lines.append(f"<{OWN_PREFIX}:document><![CDATA[{native}]]></{OWN_PREFIX}:document>")
        data = [_parameter_data(each) for each in self._plain_parameters()]
        if self.root is not None:
            self._automaton(self.root, data)
        else:
            self._data(data)
        self._close("scxml")
        return "\n".join(self._lines) + "\n"

    def _plain_parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters when each has a name that can be an id, and a default value."""
        parameters = self._document.parameters
        names = {each.name for each in parameters}
        if len(names) < len(parameters) or names & self._used:
            return ()
        if not all(is_name(each.name) and each.default.text for each in parameters):
            return ()
        self._used |= names
        return parameters

    def _automaton(self, placed: _Automaton, data: Sequence[_Attributes] = ()) -> None:
        """Write what is inside the element that stands for an automaton."""
        found = _assignments(placed.automaton.variables) if self._is_python else ()
        names = {name for name, _ in found}
        if names & self._used:
            found = ()
        else:
            self._used |= names
        self._data([*data, *([("id", name), ("expr", value)] for name, value in found)])
        for state in placed.states:
            self._state(state, placed)

    def _data(self, data: Sequence[_Attributes]) -> None:
        if data:
            self._open("datamodel")
            for attributes in data:
                self._empty("data", attributes)
            self._close("datamodel")

    def _state(self, placed: _State, automaton: _Automaton) -> None:
        state = placed.state
        self._comments(state.comments)
        regions = placed.automata if len(placed.automata) > 1 else []
        single = placed.automata[0] if len(placed.automata) == 1 else None
        tag = "final" if state.final else "parallel" if regions else "state"
        attributes = [("id", placed.id)]
        if single is not None:
            attributes += self._initial(single)
        self._open(tag, attributes)
        self._code("onentry", state.entry)
        timers = {
            id(transition): (self._new_id(f"{placed.id}_timer_{transition.id}"), delay)
            for transition in placed.transitions
            if transition.type == "time" and (delay := delay_text(transition.trigger.text)) is not None
        }
        for timer, delay in timers.values():
            self._open("onentry")
            self._empty("send", [("event", f"timeout.{timer}"), ("id", timer), ("delay", delay)])
            self._close("onentry")
        self._code("onexit", state.exit)
        for timer, _ in timers.values():
            self._open("onexit")
            self._empty("cancel", [("sendid", timer)])
            self._close("onexit")
        for transition in placed.transitions:
            event = {
                "time": f"timeout.{timers[id(transition)][0]}" if id(transition) in timers else "",
                "event": self._events.get(transition.trigger.text, ""),
                "finished": f"done.state.{placed.id}",
            }.get(transition.type, "")
            self._transition(transition, event, automaton.state(transition.destination))
        if placed.history:
            self._history(placed)
        if single is not None:
            self._automaton(single)
        for region in regions:
            self._comments(region.automaton.comments)
            self._open("state", [("id", region.id), *self._initial(region)])
            self._automaton(region)
            self._close("state")
        self._close(tag)

    def _initial(self, automaton: _Automaton) -> _Attributes:
        first = automaton.first
        if first is None:
            return ()
        return [("initial", first.id if automaton is self.root else first.history or first.id)]

    def _history(self, placed: _State) -> None:
        inside = placed.automata
        first = inside[0].first
        target = first.id if len(inside) == 1 and first is not None else " ".join(each.id for each in inside)
        self._open("history", [("id", placed.history), ("type", "deep")])
        self._empty("transition", [("target", target)])
        self._close("history")

    def _transition(self, transition: Transition, event: str, destination: _State) -> None:
        condition = transition.guard.text
        if not event:
            condition = transition.trigger.text
            if not condition.strip() or (self._is_python and expression_of(condition) is None):
                condition = NEVER if self._is_python else NEVER.lower()
        attributes: list[tuple[str, str]] = [("event", event)] if event else []
        attributes += [("cond", condition)] if condition.strip() else []
        attributes += [("target", destination.history or destination.id)]
        self._comments(transition.comments)
        if transition.code.text:
            self._open("transition", attributes)
            self._script(transition.code)
            self._close("transition")
        else:
            self._empty("transition", attributes)

    # Lines.

    def _code(self, tag: str, code: Text) -> None:
        if code.text:
            self._open(tag)
            self._script(code)
            self._close(tag)

    def _script(self, code: Text) -> None:
        self._line(f"<script>{escaped(code.text)}</script>")

    def _comments(self, comments: Sequence[Comment | object]) -> None:
        for comment in comments:
            if isinstance(comment, Comment):
                self._line(f"<!--{comment.text}-->")

    def _open(self, tag: str, attributes: _Attributes = ()) -> None:
        self._line(f"<{tag}{attributes_text(tuple(attributes))}>")
        self._depth += 1

    def _close(self, tag: str) -> None:
        self._depth -= 1
        self._line(f"</{tag}>")

    def _empty(self, tag: str, attributes: _Attributes) -> None:
        self._line(f"<{tag}{attributes_text(tuple(attributes))}/>")

    def _line(self, text: str) -> None:
        self._lines.append(INDENT * self._depth + text)


def _why_no_place(automaton: Automaton, transition: Transition) -> str:
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


def _assignments(variables: Text) -> tuple[tuple[str, str], ...]:
    """Return the names and expressions of variables, each on a line of its own: `x = 0`.

    Nothing where anything else is among them.
    """
    matches = [_ASSIGNMENT.fullmatch(line) for line in variables.text.split("\n")]
    found = [(match[1], match[2]) for match in matches if match is not None]
    is_plain = len({name for name, _ in found}) == len(matches) and all(
        is_name(name) and expression_of(value) is not None for name, value in found
    )
    return tuple(found) if is_plain else ()


def _parameter_data(parameter: Parameter) -> _Attributes:
    description = parameter.description.text
    return [
        *(("id", parameter.name), ("expr", parameter.default.text)),
        (f"{OWN_PREFIX}:type", parameter.type.text),
        *([(f"{OWN_PREFIX}:description", description)] if description else []),
    ]


def _unsaid(document: Document) -> Iterator[tuple[str, int]]:
    """Yield what only the native document says, and its line."""
    is_python = not is_foreign(document)
    for automaton in document.automata:
        if not automaton.variables.is_blank and not (is_python and _assignments(automaton.variables)):
            yield "code that gives variables their values", automaton.variables.line
        if not automaton.functions.is_blank:
            yield "functions", automaton.functions.line
        if automaton.imported is not None:
            yield "an automaton of another file", automaton.imported.line or automaton.line
        for item in automaton.inputs:
            yield "the input of an automaton", item.line
        for state in automaton.states:
            if not state.code.is_blank:
                yield "code that runs in every cycle", state.code.line
            for argument in state.arguments:
                yield "the argument of a state", argument.line
        for transition in automaton.transitions:
            trigger = transition.trigger
            if transition.type == "condition":
                if is_python and not trigger.is_blank and expression_of(trigger.text) is None:
                    yield "a condition of statements", trigger.line
                if not transition.guard.is_blank:
                    yield "the guard of a condition", transition.guard.line
