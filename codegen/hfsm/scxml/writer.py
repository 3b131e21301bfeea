"""Write a document as SCXML, the W3C's language of state charts.

What SCXML says it says in its own words; all else stands in elements of the native format, in a namespace of
our own, so that the reader gets the same document back.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics, Location

from ..code.pieces import is_foreign
from ..document import Comment, Document, Text
from ..formats.writer import write_document
from ..formats.xml_text import INDENT, attributes_text, escaped
from ..formats.xml_tree import XmlComment, XmlElement, parse_xml
from .data import assignments, is_expression, plain_parameters
from .naming import Names, Timer, native_order
from .own_elements import own_lines, with_comments
from .placement import PlacedAutomaton, PlacedState, PlacedTransition, Placement, place
from .remarks import tell
from .said import said_of_automaton, said_of_state, said_of_transition
from .vocabulary import (
    NEVER,
    OWN_NAMESPACE,
    OWN_PREFIX,
    SCXML_NAMESPACE,
    identifier,
)

__all__ = ["write_scxml"]

_PYTHON: Final = "python"
_DATAMODELS: Final = {"c++": "cplusplus"}
_Attributes = Sequence[tuple[str, str]]


def write_scxml(document: Document, path: Path, diagnostics: Diagnostics) -> str:
    """Return a document as SCXML, and tell what other programs do not see of it.

    `path` is where the document lies. Worth nothing after errors were reported. Raises
    DocumentNotWritableError.
    """
    scratch = Diagnostics()
    tree = parse_xml(write_document(document).encode(), path, scratch)
    text = ""
    if tree is not None:
        placement = place(document, tree[0])
        text = _ScxmlWriter(document, tree[0], placement).text()
        tell(document, placement, path, diagnostics)
        parse_xml(text.encode(), path, scratch)
    for found in scratch.errors:
        message = f"what would be written could not be read back: {found.message}"
        diagnostics.error("E560", message, Location(path))
    return text


class _ScxmlWriter:
    def __init__(self, document: Document, native: XmlElement, placement: Placement) -> None:
        self._document = document
        self._native = native
        self._placement = placement
        self._lines: list[str] = ['<?xml version="1.0" encoding="UTF-8"?>']
        self._depth = 0
        self._is_python = not is_foreign(document)
        self._names = Names(document, placement)
        self._order = native_order(native, placement)

    def text(self) -> str:
        root = self._placement.root
        self._comments(self._document.comments)
        namespaces = (("xmlns", SCXML_NAMESPACE), (f"xmlns:{OWN_PREFIX}", OWN_NAMESPACE))
        attributes = [*namespaces, ("version", "1.0"), ("datamodel", self._datamodel())]
        first = root.first if root is not None else None
        if first is not None:
            attributes.append(("initial", first.id))
        self._open("scxml", attributes)
        parameters = plain_parameters(self._document, self._names.used)
        self._names.used |= {parameter.name for parameter in parameters}
        self._own_document(without_parameters=bool(parameters))
        data = [
            (
                *(("id", parameter.name), ("expr", parameter.default.text)),
                (f"{OWN_PREFIX}:type", parameter.type.text),
                *((f"{OWN_PREFIX}:description", text.text) for text in (parameter.description,) if text.text),
            )
            for parameter in parameters
        ]
        if root is not None:
            self._automaton(root, data)
        else:
            self._data(data)
        self._close("scxml")
        return "\n".join(self._lines) + "\n"

    def _datamodel(self) -> str:
        language = self._document.language.text.strip().lower()
        return _PYTHON if self._is_python else _DATAMODELS.get(language) or identifier(language, "unknown")

    def _own_document(self, *, without_parameters: bool) -> None:
        lost = {each.native for each in self._placement.lost}
        left_out: set[XmlElement | XmlComment] = set()
        for comments, child in with_comments(self._native):
            if child.tag == "SubAutomata" and child not in lost:
                left_out |= {child, *comments}
            elif child.tag == "parameters" and without_parameters:
                left_out.add(child)
        self._own(self._native, left_out)

    def _automaton(self, placed: PlacedAutomaton, data: Sequence[_Attributes] = ()) -> None:
        """Write what is inside the element that stands for an automaton."""
        found = assignments(placed.automaton.variables, self._names.used) if self._is_python else ()
        left_out = said_of_automaton(placed, variables=bool(found))
        if not any(leaf.tag == "variables" for leaf in left_out if isinstance(leaf, XmlElement)):
            found = ()
        self._names.used |= {name for name, _ in found}
        self._comments(placed.comments)
        self._own(placed.native, left_out)
        self._data([*data, *([("id", name), ("expr", value)] for name, value in found)])
        for state in placed.states:
            self._state(state)

    def _data(self, data: Sequence[_Attributes]) -> None:
        if data:
            self._open("datamodel")
            for attributes in data:
                self._empty("data", attributes)
            self._close("datamodel")

    def _state(self, placed: PlacedState) -> None:
        self._comments(placed.comments)
        state = placed.state
        regions = placed.automata if len(placed.automata) > 1 else []
        single = placed.automata[0] if len(placed.automata) == 1 else None
        tag = "final" if state.final else "parallel" if regions else "state"
        self._open(tag, [("id", placed.id), *self._initial(single)])
        self._own(placed.native, said_of_state(placed))
        self._code("onentry", state.entry)
        timers = self._names.timers(placed)
        for timer in timers.values():
            self._open("onentry")
            self._empty("send", [("event", timer.event), ("id", timer.id), ("delay", timer.delay)])
            self._close("onentry")
        self._code("onexit", state.exit)
        for timer in timers.values():
            self._open("onexit")
            self._empty("cancel", [("sendid", timer.id)])
            self._close("onexit")
        for transition in placed.transitions:
            self._transition(placed, transition, timers)
        if placed in self._names.histories:
            self._history(placed)
        if single is not None:
            self._automaton(single)
        for region in regions:
            self._open("state", [("id", region.id), *self._initial(region)])
            self._automaton(region)
            self._close("state")
        self._close(tag)

    def _initial(self, automaton: PlacedAutomaton | None) -> _Attributes:
        """Return where an automaton that is not the root begins; with the history of that state, if any."""
        first = automaton.first if automaton is not None else None
        return () if first is None else [("initial", self._target(first))]

    def _target(self, state: PlacedState) -> str:
        return self._names.histories.get(state, state.id)

    def _history(self, placed: PlacedState) -> None:
        if len(placed.automata) > 1:
            target = " ".join(region.id for region in placed.automata)
        else:
            first = placed.automata[0].first
            assert first is not None, "a state that resumes has something inside"
            target = first.id
        self._open("history", [("id", self._names.histories[placed]), ("type", "deep")])
        self._empty("transition", [("target", target)])
        self._close("history")

    def _transition(
        self,
        origin: PlacedState,
        placed: PlacedTransition,
        timers: dict[PlacedTransition, Timer],
    ) -> None:
        transition = placed.transition
        condition = transition.guard
        attributes: list[tuple[str, str]] = []
        match transition.type:
            case "time":
                attributes.append(("event", timers[placed].event))
            case "event":
                attributes.append(("event", self._names.events[transition.trigger.text]))
            case "finished":
                attributes.append(("event", f"done.state.{origin.id}"))
            case _:
                condition = transition.trigger
                if not self._can_be_condition(condition):
                    condition = Text(NEVER if self._is_python else NEVER.lower())
        if not condition.is_blank:
            attributes.append(("cond", condition.text))
        destination = self._names.beside[origin][transition.destination]
        attributes.append(("target", self._target(destination)))
        self._comments(placed.comments)
        self._own(placed.native, said_of_transition(placed, condition))
        if transition.code.text:
            self._open("transition", attributes)
            self._script(transition.code)
            self._close("transition")
        else:
            self._empty("transition", attributes)

    def _can_be_condition(self, condition: Text) -> bool:
        return not condition.is_blank and (not self._is_python or is_expression(condition.text))

    def _code(self, tag: str, code: Text) -> None:
        if code.text:
            self._open(tag)
            self._script(code)
            self._close(tag)

    def _script(self, code: Text) -> None:
        self._line(f"<script>{escaped(code.text)}</script>")

    def _own(self, native: XmlElement, left_out: Collection[XmlElement | XmlComment]) -> None:
        self._lines += own_lines(native, self._depth, left_out, self._order)

    def _comments(self, comments: Sequence[XmlComment | Comment]) -> None:
        for comment in comments:
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
