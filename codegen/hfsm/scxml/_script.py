"""Read the executable content of SCXML as Python, and delayed events as timers."""

from __future__ import annotations

import json
import keyword
import re
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from decimal import Decimal
from typing import Final

from ...messages import Message
from ..codes import Code
from ..document import Text
from ..formats.writer import UNWRITABLE
from ..formats.xml_tree import XmlElement

Report = Callable[[str, XmlElement, Message], None]
"""Reports a diagnostic with a code about an element."""

_ECMASCRIPT: Final = "ECMAScript"
_ENCODED: Final = re.compile(r"_x([0-9A-F]{4,6})_")
_TIME: Final = re.compile(r"([0-9]{1,12}(?:\.[0-9]{1,9})?|\.[0-9]{1,9})(m?s)")
_MILLISECONDS: Final = {"ms": 1, "s": 1000}
_SYSTEM_NAMES: Final = re.compile(r"\b(?:In(?=\()|_event\b|_sessionid\b|_name\b|_ioprocessors\b)")
_SEND_ATTRIBUTES: Final = frozenset(("event", "target", "id"))
_SELF_TARGETS: Final = ("", "#_internal", "#_scxml")


def descendants(element: XmlElement, *tags: str) -> Iterator[XmlElement]:
    """Yield the elements with some tags at any depth inside an element."""
    for child in element.elements():
        if child.tag in tags:
            yield child
        yield from descendants(child, *tags)


def inside_all(element: XmlElement, holder: str, tag: str) -> Iterator[XmlElement]:
    """Yield the elements with a tag inside the children with the tag `holder`."""
    return (each for found in element.elements(holder) for each in found.elements(tag))


def take_timers(root: XmlElement) -> dict[tuple[XmlElement, str], str]:
    """Return the delays in ms of timers, by the element of their state and the event.

    A timer is a delayed event that a state sends to itself on entry and cancels on exit, and that no other
    state sends or waits for. The elements that send and cancel it are removed.
    """
    states = list(descendants(root, "state", "parallel"))
    events = {state: _awaited(state) for state in states}
    waiting = Counter(event for awaited in events.values() for event in awaited)
    sent = Counter(each.attributes.get("event", "") for each in descendants(root, "raise", "send"))
    timers: dict[tuple[XmlElement, str], str] = {}
    for state in states:
        cancels = {each.attributes.get("sendid", ""): each for each in inside_all(state, "onexit", "cancel")}
        gone: set[XmlElement] = set()
        for send in inside_all(state, "onentry", "send"):
            event, cancel = send.attributes.get("event", ""), cancels.get(send.attributes.get("id", ""))
            is_own = event in events[state] and waiting[event] == sent[event] == 1
            if cancel is not None and is_own and (delay := _delay(send)):
                timers[state, event] = delay
                gone |= {send, cancel}
        for holder in state.elements("onentry", "onexit"):
            holder.children = [each for each in holder.children if each not in gone]
    return timers


def _awaited(state: XmlElement) -> set[str]:
    """Return the events for which the transitions of a state wait."""
    events = (transition.attributes.get("event", "") for transition in state.elements("transition"))
    return {name for text in events for name in text.split()}


def _delay(send: XmlElement) -> str:
    """Return the delay in ms of an event that is sent within the chart, blank for any other."""
    match = _TIME.fullmatch(send.attributes.get("delay", "").strip())
    if match is None or send.attributes.get("target", "") not in ("", "#_internal"):
        return ""
    return f"{(Decimal(match[1]) * _MILLISECONDS[match[2]]).normalize():f}"


class ScriptReader:
    """Reads the code of a file. That of another `datamodel` than Python is kept, and reported."""

    def __init__(self, datamodel: str, report: Report) -> None:
        is_default = datamodel.lower() in ("", "null", "ecmascript", "javascript")
        self._is_python = datamodel.lower().startswith("python")
        self._name = _ECMASCRIPT if is_default else datamodel
        self._report = report
        self.language = ""
        """The language of the code read so far, blank for Python."""

    def expression(self, element: XmlElement, text: str) -> str:
        """Return an expression as it is; `element` is for the messages."""
        self._check(element, text)
        return text

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
                    self._report_lost(
                        element, Message("`{name}` is not imported: write it in Python", name=name)
                    )

    def _send(self, element: XmlElement) -> Iterator[str]:
        event, attributes = element.attributes.get("event", ""), element.attributes
        if "delay" in attributes or "delayexpr" in attributes:
            self._report_lost(
                element,
                Message(
                    "the delayed event `{event}` is not imported: only states have timers", event=event[:60]
                ),
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
                element, Message("an event for other programs, or with a computed name, is not imported")
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
            message = Message(
                "`{first}` is {language}: it is kept, but cannot run until it is translated to Python",
                first=first,
                language=self._name,
            )
            self._report(Code.KEPT_LANGUAGE, element, message)
        elif (name := _SYSTEM_NAMES.search(text)) is not None:
            self._report_lost(
                element, Message("`{name}` does not exist here: the code would raise NameError", name=name[0])
            )

    def _report_lost(self, element: XmlElement, message: Message) -> None:
        self._report(Code.SCXML_NOT_IMPORTED, element, message)


def decode_event(name: str) -> str:
    """Return the name of an event without the writer's encoding: `_x0020_` is a space."""
    return _ENCODED.sub(_decoded, name)


def is_name(text: str) -> bool:
    """Return whether a text is a valid name of a variable."""
    return text.isascii() and text.isidentifier() and not keyword.iskeyword(text)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _decoded(match: re.Match[str]) -> str:
    code = int(match[1], 16)
    return chr(code) if code <= 0x10FFFF and not UNWRITABLE.search(chr(code)) else match[0]
