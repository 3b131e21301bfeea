"""Write a document as SCXML, the W3C's language of state charts (Recommendation of 1 September 2015).

Everything that SCXML can express is written as SCXML. The complete native document comes first, in an element
of our namespace, so that the reader returns the same document.
"""

from __future__ import annotations

import ast
import re
import warnings
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics, Location
from codegen.hfsm.code.language import is_foreign
from codegen.hfsm.code.text import parse_piece
from codegen.hfsm.codes import Code
from codegen.hfsm.document import NO_CHILD, Automaton, Document, Node, State, Text, Transition
from codegen.hfsm.formats.writer import write_document
from codegen.messages import Message

SCXML_NAMESPACE: Final = "http://www.w3.org/2005/07/scxml"
"""The namespace of the W3C's recommendation."""

OWN_NAMESPACE: Final = "urn:visualhfsm:document"
"""The namespace of the native document in an exported file."""

_MAX_DEPTH: Final = 24
"""Levels of automata in a file; each takes up to two elements, and the reader accepts 64."""

# Latin letters with which a name in XML may start.
_LETTERS: Final = "A-Z_a-z\u00c0-\u00d6\u00d8-\u00f6\u00f8-\u02ff"
_NOT_IN_IDS: Final = re.compile(f"[^{_LETTERS}0-9-]+")
# In SCXML an event `a` also matches `a.b`: full stops and reserved first words are encoded, too.
_NOT_IN_EVENTS: Final = re.compile(
    rf"[^{_LETTERS}0-9-]|_(?=x[0-9A-F]{{4,6}}_)|\A(?:d(?=one\Z)|e(?=rror\Z)|t(?=imeout\Z))"
)
_ASSIGNMENT: Final = re.compile(r"([A-Za-z_][A-Za-z_0-9]*) = (\S.*)")
_MILLISECONDS: Final = re.compile(r"[0-9]{1,12}(?:\.[0-9]{1,9})?")


def write(document: Document, path: Path, diagnostics: Diagnostics) -> str:
    """Return a document as SCXML, and report what other programs ignore.

    `path` is that of the document. Raises DocumentNotWritableError.
    """
    return _Writer(document, path, diagnostics).text()


def _is_expression(code: str) -> bool:
    """Return whether a text is a Python expression."""
    with warnings.catch_warnings(action="ignore"):
        tree = parse_piece(code)
    match tree:
        case ast.Module(body=[ast.Expr()]):
            return True
    return False


@dataclass(slots=True)
class _Placed:
    """A state with its element and the id of its history, blank if its automata restart."""

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
        self._repeated: Counter[str] = Counter()
        """The number of conflicts for each id."""
        self._by_id = {each.id: each for each in reversed(document.automata)}
        self._placed: dict[int, Automaton] = {}
        """The automata that have been written, by id."""
        self._omitted: dict[Message, int] = {}
        """Features without an equivalent in SCXML, with the line of the first use."""

    def text(self) -> str:
        """Return the text of the file."""
        # A CDATA section ends with its first `]]>`.
        native = write_document(self._document).partition("\n")[2].replace("]]>", "]]]]><![CDATA[>")
        language = self._document.language.text.strip().lower().replace("+", "plus")
        root = ET.Element("scxml", {"xmlns": SCXML_NAMESPACE, "xmlns:hfsm": OWN_NAMESPACE, "version": "1.0"})
        root.set("datamodel", "python" if self._is_python else _identifier(language))
        root.text = "\n"
        self._omit(Message("parameters"), self._document.parameters)
        top = next((each for each in self._document.automata if each.father == NO_CHILD), None)
        if top is not None:
            self._placed[top.id] = top
            self._automaton(root, top)
        if top is None or not top.states:
            self._warn(self._document, Message("SCXML requires a state: other programs may reject the file"))
        for automaton in self._document.automata:
            if self._placed.get(automaton.id) is not automaton:
                message = Message("automaton {id} cannot be exported: no state can own it", id=automaton.id)
                self._warn(automaton, message)
        for kind, line in self._omitted.items():
            message = Message(
                "SCXML has no equivalent of {kind}: it is kept, but other programs ignore it", kind=kind
            )
            self._diagnostics.note(Code.SCXML_NO_EQUIVALENT, message, Location(self._path, line))
        ET.indent(root)
        start, end, rest = ET.tostring(root, encoding="unicode").partition(">")
        document = f"<hfsm:document><![CDATA[{native}]]></hfsm:document>"
        return f'<?xml version="1.0" encoding="UTF-8"?>\n{start}{end}\n{document}{rest}\n'

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
                self._transition(each, transition, targets.get(transition.destination))
            self._children(each, depth + 1)
            self._omit(Message("code that runs in every cycle"), [] if state.code.is_blank else [state.code])
            self._omit(Message("the argument of a state"), state.arguments)
            self._omit(Message("the result of a state"), state.results)
        for transition in (each for leaving in outgoing.values() for each in leaving):
            message = Message("transition {id} cannot be exported: it leaves no state", id=transition.id)
            self._warn(transition, message)
        self._omit(Message("functions"), [] if automaton.functions.is_blank else [automaton.functions])
        self._omit(
            Message("an automaton of another file"),
            [] if automaton.imported is None else [automaton.imported],
        )
        self._omit(Message("the input of an automaton"), automaton.inputs)
        self._omit(Message("the output of an automaton"), automaton.outputs)
        self._omit(Message("a note or a frame"), automaton.annotations)
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

    def _transition(self, placed: _Placed, transition: Transition, target: str | None) -> None:
        event, condition, text = "", transition.guard.text, transition.trigger.text.strip()
        kind = "" if target is None or placed.state.final else transition.type
        match kind:
            case "time" if _MILLISECONDS.fullmatch(text):
                timer = self._new_id(f"{placed.id}_timer_{transition.id}")
                event = f"timeout.{timer}"
                entry = ET.SubElement(placed.element, "onentry")
                ET.SubElement(entry, "send", event=event, id=timer, delay=f"{text}ms")
                ET.SubElement(ET.SubElement(placed.element, "onexit"), "cancel", sendid=timer)
            case "event" if text:
                event = _NOT_IN_EVENTS.sub(lambda match: f"_x{ord(match[0]):04X}_", transition.trigger.text)
            case "finished":
                event = f"done.state.{placed.id}"
            case "condition":
                condition = self._condition(transition.trigger)
            case _:
                message = Message(
                    "transition {id} cannot be exported: it leads nowhere, its state is final, or its type, "
                    "time or event is missing or unknown",
                    id=transition.id,
                )
                self._warn(transition, message)
                return
        element = ET.SubElement(placed.element, "transition", {"event": event} if event else {})
        if condition.strip():
            element.set("cond", condition)
        element.set("target", target or "")
        if transition.code.text:
            ET.SubElement(element, "script").text = transition.code.text

    def _condition(self, text: Text) -> str:
        """Return a condition for SCXML: one that is empty or has statements never holds."""
        if not self._is_python:
            return "false" if text.is_blank else text.text
        is_expression = _is_expression(text.text)
        self._omit(Message("a condition of statements"), [] if text.is_blank or is_expression else [text])
        return text.text if is_expression else "False"

    def _variables(self, parent: ET.Element, automaton: Automaton) -> None:
        """Write the variables of an automaton as data if all are `name = value` with unique names."""
        if automaton.variables.is_blank:
            return
        lines = automaton.variables.text.split("\n")
        found = {match[1]: match[2] for line in lines if (match := _ASSIGNMENT.fullmatch(line)) is not None}
        is_plain = len(found) == len(lines) and not found.keys() & self._ids
        is_plain &= all(map(_is_expression, found.values()))
        if not self._is_python or not is_plain:
            self._omit(Message("code that sets variables"), [automaton.variables])
            return
        self._ids |= found.keys()
        datamodel = ET.Element("datamodel")
        parent.insert(0, datamodel)
        for name, value in found.items():
            ET.SubElement(datamodel, "data", id=name, expr=value)

    def _new_id(self, text: str) -> str:
        base = found = _identifier(text)
        while found in self._ids:
            self._repeated[base] += 1
            found = f"{base}_{self._repeated[base] + 1}"
        self._ids.add(found)
        return found

    def _omit(self, kind: Message, found: Sequence[Node | Text]) -> None:
        """Remember elements without an equivalent in SCXML."""
        if found:
            self._omitted.setdefault(kind, found[0].line)

    def _warn(self, node: Node, message: Message) -> None:
        place = Location(self._path, node.line, max(1, node.column))
        self._diagnostics.warning(Code.SCXML_NOT_EXPORTED, message, place)


def _add_script(parent: ET.Element, tag: str, code: Text) -> None:
    if code.text:
        ET.SubElement(ET.SubElement(parent, tag), "script").text = code.text


def _identifier(text: str) -> str:
    """Return an id for a text, without full stops, so that no event matches another one."""
    found = _NOT_IN_IDS.sub("_", text).strip("_") or "state"
    return f"_{found}" if found[0] in "-0123456789" else found
