"""Translate the executable content of SCXML: code into Python, and delayed events into timers."""

from __future__ import annotations

import ast
import json
import keyword
import re
import textwrap
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from decimal import Decimal
from typing import Final

from ..codes import Code
from ..document import Text
from ..formats.writer import UNWRITABLE
from ..formats.xml_tree import XmlElement
from .writer import expression_of

__all__ = ["ScriptReader", "decode_event", "descendants", "extract_timers", "inside_all", "is_name"]

Report = Callable[[str, XmlElement, str], None]
"""Reports a diagnostic with a code about an element."""

_ECMASCRIPT: Final = "ECMAScript"
_ENCODED: Final = re.compile(r"_x([0-9A-F]{4,6})_")
_QUOTED: Final = re.compile(r"""\s*(['"])([^'"\\]*)\1\s*""")
_TIME: Final = re.compile(r"([0-9]{1,12}(?:\.[0-9]{1,9})?|\.[0-9]{1,9})(ms|s|m|h|d)?")
_MILLISECONDS: Final = {None: 1, "ms": 1, "s": 1000, "m": 60_000, "h": 3_600_000, "d": 86_400_000}
_WORDS: Final = re.compile(r"""'[^'\\\n]*'|"[^"\\\n]*"|[\w$.]+|\s*(?:&&|\|\|)\s*|[=!]==""")
_IN_PYTHON: Final = {"true": "True", "false": "False", "===": "==", "!==": "!=", "&&": " and ", "||": " or "}
_NOT_NAMES: Final = frozenset(("undefined", "null", "NaN", "Infinity", "In", "_event", "this"))
_SYSTEM_NAMES: Final = re.compile(r"\b(?:In(?=\()|_event\b|_sessionid\b|_name\b|_ioprocessors\b)")
_SEND_ATTRIBUTES: Final = frozenset(("event", "target", "id"))
_SELF_TARGETS: Final = ("", "#_internal", "#_scxml")
_COMMON: Final = (
    *(ast.Expression, ast.BoolOp, ast.And, ast.Or, ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.USub, ast.Load),
    *(ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE),
)


def descendants(element: XmlElement, *tags: str) -> Iterator[XmlElement]:
    """Yield the elements with some tags at any depth inside an element."""
    for child in element.elements():
        if child.tag in tags:
            yield child
        yield from descendants(child, *tags)


def inside_all(element: XmlElement, holder: str, tag: str) -> Iterator[XmlElement]:
    """Yield the elements with a tag inside the children with the tag `holder`."""
    return (each for found in element.elements(holder) for each in found.elements(tag))


def extract_timers(root: XmlElement, report: Report) -> dict[tuple[XmlElement, str], str]:
    """Return the delays in ms of timers, by the element of their state and the event.

    In SCXML a timer is a delayed event that a state sends to itself on entry, and that no other state sends
    or waits for. The elements that send and cancel it are removed.
    """
    senders: dict[XmlElement, XmlElement] = {}
    waiting: dict[str, set[XmlElement]] = defaultdict(set)
    for state in descendants(root, "state", "parallel"):
        for send in inside_all(state, "onentry", "send"):
            if _delay(send) and send.attributes.get("target", "") in ("", "#_internal"):
                senders[send] = state
        for transition in state.elements("transition"):
            for event in transition.attributes.get("event", "").split():
                waiting[event].add(state)
    sends: dict[str, list[XmlElement]] = defaultdict(list)
    for element in descendants(root, "raise", "send"):
        sends[element.attributes.get("event", "")].append(element)
    timers: dict[tuple[XmlElement, str], str] = {}
    taken: dict[XmlElement, list[XmlElement]] = defaultdict(list)
    for event, found in sends.items():
        if all(each in senders for each in found) and waiting[event] <= {senders[each] for each in found}:
            for send in found:
                state = senders[send]
                if state in waiting[event] and (state, event) not in timers:
                    timers[state, event] = _delay(send)
                    taken[state].append(send)
    for state, found in taken.items():
        _remove_timers(state, found, report)
    return timers


def _remove_timers(state: XmlElement, sends: list[XmlElement], report: Report) -> None:
    """Remove the elements of a state that send and cancel the events of its timers."""
    cancels = {each.attributes.get("sendid", ""): each for each in inside_all(state, "onexit", "cancel")}
    gone = {*sends, *(cancels[name] for each in sends if (name := each.attributes.get("id")) in cancels)}
    for holder in state.elements("onentry", "onexit"):
        holder.children = [each for each in holder.children if each not in gone]
    for send in sends:
        if send.attributes.get("id") not in cancels:
            message = (
                "here the timer ends when the state is left; in SCXML it continues, as there is no `cancel`"
            )
            report(Code.SCXML_OTHER_FORM, send, message)


def _delay(send: XmlElement) -> str:
    """Return the delay of an event in ms, blank if it is not a time."""
    quoted = _QUOTED.fullmatch(send.attributes.get("delayexpr", ""))
    match = _TIME.fullmatch(send.attributes.get("delay", quoted[2] if quoted else "").strip())
    return f"{(Decimal(match[1]) * _MILLISECONDS[match[2]]).normalize():f}" if match is not None else ""


class ScriptReader:
    """Translates the code of a file into Python.

    Expressions of another `datamodel` than Python are translated if Python has the same syntax elements. Any
    other code is kept and reported; then the document is in `language`.
    """

    def __init__(self, datamodel: str, report: Report) -> None:
        is_default = datamodel.lower() in ("", "null", "ecmascript", "javascript")
        self._is_python = datamodel.lower().startswith("python")
        self._name = _ECMASCRIPT if is_default else datamodel
        self._report = report
        self.language = ""
        """The language of the code read so far, blank for Python."""

    def expression(self, element: XmlElement, text: str) -> str:
        """Return an expression in Python, or unchanged; `element` is for the messages."""
        python = None if self._is_python else _translated(text)
        if python is None:
            self._check(element, text)
        return text if python is None else python

    def code(self, holders: Iterable[XmlElement]) -> Text:
        """Return the code in elements such as `onentry`."""
        found = [each for holder in holders for each in holder.elements()]
        if len(found) == 1 and found[0].tag == "script" and "src" not in found[0].attributes:
            self._check(found[0], found[0].text)
            return found[0].content
        text = "\n".join(self.lines(found))
        return Text(text, found[0].line, found[0].column) if text else Text()

    def lines(self, elements: Iterable[XmlElement]) -> Iterator[str]:
        """Yield the lines of Python for elements of executable content."""
        for element in elements:
            attributes = element.attributes
            match element.tag:
                case "script" if "src" not in attributes:
                    self._check(element, element.text)
                    yield from textwrap.dedent(element.text).strip("\n").split("\n")
                case "raise":
                    yield f"self.send({_quoted(decode_event(attributes.get('event', '')))})"
                case "send":
                    yield from self._send(element)
                case "log":
                    label, value = _quoted(attributes.get("label", "")), attributes.get("expr", "").strip()
                    arguments = (
                        f'%s %s", {label}, {self.expression(element, value)}' if value else f'%s", {label}'
                    )
                    yield f'self.log.info("{arguments})'
                case "assign" if is_name(attributes.get("location", "").strip()):
                    text = attributes.get("expr", element.text).strip()
                    value = self.expression(element, text) if text else "None"
                    yield f"{attributes['location'].strip()} = {value}"
                case "if":
                    yield from self._if(element)
                case name:
                    self._report_lost(element, f"`{name}` is not imported: write it in Python")

    def _send(self, element: XmlElement) -> Iterator[str]:
        event, attributes = element.attributes.get("event", ""), element.attributes
        if "delay" in attributes or "delayexpr" in attributes:
            self._report_lost(
                element, f"the delayed event `{event[:60]}` is not imported: only states have timers"
            )
            return
        is_plain = attributes.get("target", "") in _SELF_TARGETS and attributes.keys() <= _SEND_ATTRIBUTES
        data: list[str] = []
        for item in element.elements():
            name, value = item.attributes.get("name", ""), item.attributes.get("expr", "").strip()
            is_plain &= item.tag == "param" and bool(value)
            data.append(f"{_quoted(name)}: {self.expression(item, value)}")
        if not event or not is_plain:
            self._report_lost(
                element, "an event for other programs, or with a computed name, is not imported"
            )
            return
        values = f", {{{', '.join(data)}}}" if data else ""
        yield f"self.send({_quoted(decode_event(event))}{values})"

    def _if(self, element: XmlElement) -> Iterator[str]:
        branch: list[XmlElement] = []
        yield f"if {self._condition(element)}:"
        for child in element.elements():
            if child.tag not in ("elseif", "else"):
                branch.append(child)
                continue
            yield from self._block(branch)
            branch = []
            yield f"elif {self._condition(child)}:" if child.tag == "elseif" else "else:"
        yield from self._block(branch)

    def _condition(self, element: XmlElement) -> str:
        return self.expression(element, element.attributes.get("cond", "").strip() or "True")

    def _block(self, elements: Iterable[XmlElement]) -> Iterator[str]:
        lines = list(self.lines(elements))
        yield from (f"    {line}" if line else line for line in lines or ["pass"])

    def _check(self, element: XmlElement, text: str) -> None:
        """Report code that cannot run here."""
        if not self._is_python and text.strip():
            self.language = self._name
            first = text.strip().partition("\n")[0][:60]
            message = (
                f"`{first}` is {self._name}: it is kept, but cannot run until it is translated to Python"
            )
            self._report(Code.KEPT_LANGUAGE, element, message)
        elif (name := _SYSTEM_NAMES.search(text)) is not None:
            self._report_lost(element, f"`{name[0]}` does not exist here: the code would raise NameError")

    def _report_lost(self, element: XmlElement, message: str) -> None:
        self._report(Code.SCXML_NOT_IMPORTED, element, message)


def decode_event(name: str) -> str:
    """Return the name of an event without the writer's encoding: `_x0020_` is a space."""
    return _ENCODED.sub(_decoded, name)


def is_name(text: str) -> bool:
    """Return whether a text is a valid name of a variable."""
    return text.isascii() and text.isidentifier() and not keyword.iskeyword(text)


def _translated(text: str) -> str | None:
    """Return an expression of ECMAScript in Python, or None if Python lacks one of its syntax elements."""
    python = _WORDS.sub(lambda match: _IN_PYTHON.get(match[0].strip(), match[0]), text.strip())
    parsed = expression_of(python)
    return python if parsed is not None and all(map(_is_common, ast.walk(parsed))) else None


def _is_common(node: ast.AST) -> bool:
    match node:
        case ast.Name(id=name):
            return name not in _NOT_NAMES
        case ast.Constant(value=value):
            return isinstance(value, int | float | str)
        case ast.Compare(ops=operators):
            return len(operators) == 1
        case ast.UnaryOp(op=operator):
            return isinstance(operator, ast.USub)
    return isinstance(node, _COMMON)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _decoded(match: re.Match[str]) -> str:
    code = int(match[1], 16)
    return chr(code) if code <= 0x10FFFF and not UNWRITABLE.search(chr(code)) else match[0]
