"""Write a document as SCXML, the W3C's language of state charts (Recommendation of 1 September 2015).

What SCXML can express is written in its own elements. The whole native document stands in front of them, in
an element of our namespace, so that the reader returns the same document.
"""

from __future__ import annotations

import ast
import keyword
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics, Location

from ..code.language import is_foreign
from ..code.text import parse_piece, without_warnings
from ..codes import Code
from ..document import NO_CHILD, Automaton, Document, Node, State, Text, Transition
from ..formats.writer import is_writable, write_document

__all__ = [
    "OWN_NAMESPACE",
    "OWN_PREFIX",
    "SCXML_NAMESPACE",
    "decode_event",
    "expression_of",
    "is_name",
    "write_scxml",
]

SCXML_NAMESPACE: Final = "http://www.w3.org/2005/07/scxml"
"""The namespace of the W3C's recommendation."""

OWN_NAMESPACE: Final = "urn:visualhfsm:document"
"""The namespace of the native document in a file that was written here."""

OWN_PREFIX: Final = "hfsm"
"""The prefix of that namespace in written files."""

_MAX_DEPTH: Final = 24
"""Levels of automata in a file, each of up to two elements, of which the reader takes 64."""

# The characters that XML allows at the start of a name, without the colon.
_NAME_START: Final = (
    "A-Z_a-z\u00c0-\u00d6\u00d8-\u00f6\u00f8-\u02ff\u0370-\u037d\u037f-\u1fff\u200c\u200d\u2070-\u218f"
    "\u2c00-\u2fef\u3001-\ud7ff\uf900-\ufdcf\ufdf0-\ufffd\U00010000-\U000effff"
)
_STARTS_NAME: Final = re.compile(f"[{_NAME_START}]")
_NOT_IN_IDS: Final = re.compile(f"[^{_NAME_START}0-9\u00b7-]+")
# An event `a` also matches `a.b` in SCXML, so that full stops and the reserved first words are encoded, too.
_NOT_IN_EVENTS: Final = re.compile(
    rf"[^{_NAME_START}0-9-]|_(?=x[0-9A-F]{{4,6}}_)|\A(?:d(?=one\Z)|e(?=rror\Z)|t(?=imeout\Z))"
)
_ENCODED: Final = re.compile(r"_x([0-9A-F]{4,6})_")
_ASSIGNMENT: Final = re.compile(r"([A-Za-z_][A-Za-z_0-9]*) = (\S.*)")
_MILLISECONDS: Final = re.compile(r"[0-9]{1,12}(?:\.[0-9]{1,9})?")


def write_scxml(document: Document, path: Path, diagnostics: Diagnostics) -> str:
    """Return a document as SCXML, and report what other programs do not see of it.

    `path` is where the document lies. Raises DocumentNotWritableError.
    """
    return _Writer(document, path, diagnostics).text()


def decode_event(name: str) -> str:
    """Return the name of an event that may have been encoded: `_x0020_` is a blank."""
    return _ENCODED.sub(_decoded, name)


def is_name(text: str) -> bool:
    """Return whether a text can be the name of a variable and an id of SCXML."""
    return text.isascii() and text.isidentifier() and not keyword.iskeyword(text)


def expression_of(code: str) -> ast.expr | None:
    """Return the tree of an expression of Python, or None when the text is none."""
    with without_warnings():
        tree = parse_piece(code)
    match tree:
        case ast.Module(body=[ast.Expr(value=value)]):
            return value
    return None


@dataclass(slots=True)
class _Placed:
    """A state with its element, and the id of its history, blank where what is inside restarts."""

    state: State
    element: ET.Element
    id: str
    children: list[Automaton]
    history: str


class _Writer:
    def __init__(self, document: Document, path: Path, diagnostics: Diagnostics) -> None:
        self._document = document
        self._path = path
        self._diagnostics = diagnostics
        self._is_python = not is_foreign(document)
        self._ids: set[str] = set()
        """The ids of the file."""
        self._by_id = {each.id: each for each in reversed(document.automata)}
        self._placed: dict[int, Automaton] = {}
        """The automata that are written, by their ids."""
        self._unsaid: dict[str, int] = {}
        """Kinds of things for which SCXML has no word, with the line of the first."""

    def text(self) -> str:
        """Return the file."""
        # A CDATA section ends with its first `]]>`.
        native = write_document(self._document).partition("\n")[2].replace("]]>", "]]]]><![CDATA[>")
        root = ET.Element("scxml", {"xmlns": SCXML_NAMESPACE, f"xmlns:{OWN_PREFIX}": OWN_NAMESPACE})
        language = self._document.language.text.strip().lower().replace("+", "plus")
        root.set("version", "1.0")
        root.set("datamodel", "python" if self._is_python else _identifier(language))
        root.text = "\n"
        top = next((each for each in self._document.automata if each.father == NO_CHILD), None)
        if top is not None:
            self._placed[top.id] = top
            self._automaton(root, top)
        if top is None or not top.states:
            message = "there is no state, of which SCXML wants one: other programs may refuse the file"
            self._diagnostics.warning(Code.SCXML_NO_PLACE, message, Location(self._path))
        for automaton in self._document.automata:
            if self._placed.get(automaton.id) is not automaton:
                reason = "no state owns it that can in SCXML"
                self._report_no_place(automaton, f"automaton {automaton.id}", reason)
        if self._document.parameters:
            self._unsaid["parameters"] = self._document.parameters[0].line
        for kind, line in self._unsaid.items():
            message = f"SCXML has no word for {kind}: it is kept, and other programs do not see it"
            self._diagnostics.note(Code.SCXML_NO_WORD, message, Location(self._path, line))
        ET.indent(root)
        head, end, rest = ET.tostring(root, encoding="unicode").partition(">")
        native = f"<{OWN_PREFIX}:document><![CDATA[{native}]]></{OWN_PREFIX}:document>"
        return f'<?xml version="1.0" encoding="UTF-8"?>\n{head}{end}\n{native}{rest}\n'

    def _automaton(self, parent: ET.Element, automaton: Automaton, depth: int = 1) -> str:
        """Write the states of an automaton into an element, and return the id of the first."""
        states = [self._place(parent, automaton, state, depth) for state in automaton.states]
        targets = {each.state.id: each.history or each.id for each in reversed(states)}
        self._variables(parent, automaton)
        outgoing = automaton.all_outgoing()
        for each in states:
            state = each.state
            _add_script(each.element, "onentry", state.entry)
            _add_script(each.element, "onexit", state.exit)
            for transition in outgoing.pop(state.id, ()):
                reason = _why_no_place(state, transition, targets)
                if reason:
                    self._report_no_place(transition, f"transition {transition.id}", reason)
                else:
                    self._transition(each, transition, targets[transition.destination])
            self._children(each, depth + 1)
        for transition in (each for leaving in outgoing.values() for each in leaving):
            self._report_no_place(transition, f"transition {transition.id}", "it leaves no state")
        self._report_unsaid(automaton)
        if not states:
            return ""
        first = next((each for each in states if each.state.initial), states[0])
        parent.set("initial", (first.history if depth > 1 else "") or first.id)
        return first.id

    def _place(self, parent: ET.Element, automaton: Automaton, state: State, depth: int) -> _Placed:
        """Add the element of a state."""
        children: list[Automaton] = []
        for number in () if state.final or depth >= _MAX_DEPTH else state.children:
            child = self._by_id.get(number)
            if child is not None and number not in self._placed and child.father == automaton.id:
                self._placed[number] = child
                children.append(child)
        name = self._new_id(state.name)
        resumes = any(each.states for each in children) and state.history.text.strip() != "restart"
        tag = "final" if state.final else "parallel" if len(children) > 1 else "state"
        element = ET.SubElement(parent, tag, id=name)
        return _Placed(state, element, name, children, self._new_id(f"{name}_history") if resumes else "")

    def _children(self, placed: _Placed, depth: int) -> None:
        """Write the automata of a state, and its history."""
        firsts: list[str] = []
        for child in placed.children:
            if len(placed.children) == 1:
                firsts.append(self._automaton(placed.element, child, depth))
            else:
                region = self._new_id(f"{placed.id}_{child.id}")
                self._automaton(ET.SubElement(placed.element, "state", id=region), child, depth)
                firsts.append(region)
        if placed.history:
            history = ET.SubElement(placed.element, "history", id=placed.history, type="deep")
            ET.SubElement(history, "transition", target=" ".join(firsts))

    def _transition(self, placed: _Placed, transition: Transition, target: str) -> None:
        event, condition = "", transition.guard.text
        match transition.type:
            case "time":
                timer = self._new_id(f"{placed.id}_timer_{transition.id}")
                event, delay = f"timeout.{timer}", f"{transition.trigger.text.strip()}ms"
                entry = ET.SubElement(placed.element, "onentry")
                ET.SubElement(entry, "send", event=event, id=timer, delay=delay)
                ET.SubElement(ET.SubElement(placed.element, "onexit"), "cancel", sendid=timer)
            case "event":
                event = _NOT_IN_EVENTS.sub(_encoded, transition.trigger.text)
            case "finished":
                event = f"done.state.{placed.id}"
            case _:
                condition = self._condition(transition)
        element = ET.SubElement(placed.element, "transition", {"event": event} if event else {})
        if condition.strip():
            element.set("cond", condition)
        element.set("target", target)
        if transition.code.text:
            ET.SubElement(element, "script").text = transition.code.text

    def _condition(self, transition: Transition) -> str:
        """Return the condition of a transition that has no event; one that SCXML cannot hold never holds."""
        text, guard = transition.trigger, transition.guard
        if not guard.is_blank:
            self._unsaid.setdefault("the guard of a condition", guard.line)
        if text.is_blank:
            return "False" if self._is_python else "false"
        if self._is_python and expression_of(text.text) is None:
            self._unsaid.setdefault("a condition of statements", text.line)
            return "False"
        return text.text

    def _variables(self, parent: ET.Element, automaton: Automaton) -> None:
        """Write the variables of an automaton as data when all are `name = value` and no name is taken."""
        if automaton.variables.is_blank:
            return
        lines = automaton.variables.text.split("\n")
        found = {match[1]: match[2] for line in lines if (match := _ASSIGNMENT.fullmatch(line)) is not None}
        is_plain = len(found) == len(lines) and not found.keys() & self._ids
        is_plain &= all(is_name(name) and expression_of(value) is not None for name, value in found.items())
        if not self._is_python or not is_plain:
            self._unsaid.setdefault("code that gives variables their values", automaton.variables.line)
            return
        self._ids |= found.keys()
        datamodel = ET.Element("datamodel")
        parent.insert(0, datamodel)
        for name, value in found.items():
            ET.SubElement(datamodel, "data", id=name, expr=value)

    def _new_id(self, text: str) -> str:
        base = found = _identifier(text)
        number = 1
        while found in self._ids:
            number += 1
            found = f"{base}_{number}"
        self._ids.add(found)
        return found

    def _report_unsaid(self, automaton: Automaton) -> None:
        kinds: list[tuple[str, Sequence[Node | Text]]] = [
            ("functions", () if automaton.functions.is_blank else [automaton.functions]),
            ("an automaton of another file", () if automaton.imported is None else [automaton.imported]),
            ("the input of an automaton", automaton.inputs),
            ("code that runs in every cycle", [e.code for e in automaton.states if not e.code.is_blank]),
            ("the argument of a state", [each for state in automaton.states for each in state.arguments]),
        ]
        for kind, found in kinds:
            for each in found:
                self._unsaid.setdefault(kind, each.line or automaton.line)

    def _report_no_place(self, node: Node, name: str, reason: str) -> None:
        message = f"{name} has no place in SCXML, and other programs do not see it: {reason}"
        place = Location(self._path, node.line, max(1, node.column))
        self._diagnostics.warning(Code.SCXML_NO_PLACE, message, place)


def _why_no_place(origin: State, transition: Transition, targets: Mapping[int, str]) -> str:
    """Return why a transition has no place in SCXML, blank when it has one."""
    if transition.destination not in targets:
        return "it leads to no state"
    if origin.final:
        return "a final state has no transitions in SCXML"
    match transition.type:
        case "time" if not _MILLISECONDS.fullmatch(transition.trigger.text.strip()):
            return "its time is no number of milliseconds"
        case "event" if not transition.trigger.text:
            return "it names no event"
        case "time" | "event" | "condition" | "finished":
            return ""
    return f"its type `{transition.type[:40]}` is unknown"


def _add_script(parent: ET.Element, tag: str, code: Text) -> None:
    if code.text:
        ET.SubElement(ET.SubElement(parent, tag), "script").text = code.text


def _identifier(text: str) -> str:
    """Return an id made from a text; it has no full stop, so that no event matches another's."""
    found = _NOT_IN_IDS.sub("_", text).strip("_") or "state"
    return found if _STARTS_NAME.match(found) else f"_{found}"


def _encoded(match: re.Match[str]) -> str:
    return f"_x{ord(match[0]):04X}_"


def _decoded(match: re.Match[str]) -> str:
    code = int(match[1], 16)
    return chr(code) if code <= 0x10FFFF and is_writable(chr(code)) else match[0]
