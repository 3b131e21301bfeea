"""Read the executable content of SCXML as Python, and delayed events as timers."""

from __future__ import annotations

import ast
import json
import keyword
import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from decimal import Decimal
from functools import cached_property
from typing import Final

from codegen.hfsm.code.text import parse_piece, split
from codegen.hfsm.codes import Code
from codegen.hfsm.document import Text
from codegen.hfsm.formats.writer import UNWRITABLE
from codegen.hfsm.formats.xml_tree import XmlElement
from codegen.messages import Message

Report = Callable[[str, XmlElement, Message], None]
"""Reports a diagnostic with a code about an element."""

_ECMASCRIPT: Final = "ECMAScript"
_ENCODED: Final = re.compile(r"_x([0-9A-F]{4,6})_")
_TIME: Final = re.compile(r"([0-9]{1,12}(?:\.[0-9]{1,9})?|\.[0-9]{1,9})(m?s)")
_MILLISECONDS: Final = {"ms": 1, "s": 1000}
_SYSTEM_NAMES: Final = re.compile(r"\b(?:In(?=\()|_event\b|_sessionid\b|_name\b|_ioprocessors\b)")
_SEND_ATTRIBUTES: Final = frozenset(("event", "target", "type", "id", "namelist", "delay", "delayexpr"))
_SELF_TARGETS: Final = ("", "#_internal", "#_scxml")
_SELF_TYPES: Final = ("", "scxml", "http://www.w3.org/TR/scxml/#SCXMLEventProcessor")
_JSON_WORDS: Final = re.compile(r"\b(?:true|false|null)\b")


def descendants(element: XmlElement, *tags: str) -> Iterator[XmlElement]:
    """Yield the elements with some tags, or all, at any depth inside an element, without what it invokes."""
    for child in element.elements():
        if not tags or child.tag in tags:
            yield child
        if child.tag != "invoke":
            yield from descendants(child, *tags)


def inside_all(element: XmlElement, holder: str, tag: str) -> Iterator[XmlElement]:
    """Yield the elements with a tag inside the children with the tag `holder`."""
    return (each for found in element.elements(holder) for each in found.elements(tag))


def take_timers(root: XmlElement, report: Report) -> dict[tuple[XmlElement, str], str]:
    """Return the delays in ms of timers, by the element of their state and the event.

    A timer is a delayed event that a state sends to itself on entry, that no other state sends or waits for,
    and that is cancelled only where the state is left. The elements that send and cancel it are removed. One
    that outlives its state, since nothing cancels it on exit, is reported.
    """
    states = list(descendants(root, "state", "parallel"))
    awaited = [
        (state, first_words(name))
        for state in states
        for transition in state.elements("transition")
        for name in transition.attributes.get("event", "").split()
    ]
    sent = Counter(each.attributes.get("event", "") for each in descendants(root, "raise", "send"))
    cancelled = Counter(each.attributes.get("sendid") for each in descendants(root, "cancel"))
    timers: dict[tuple[XmlElement, str], str] = {}
    for state in states:
        exits = {*inside_all(state, "onexit", "cancel")}
        leaving = [each for each in state.elements("transition") if "target" in each.attributes]
        leaving = [each for each in leaving if each.attributes.get("type") != "internal"]
        gone: set[XmlElement] = set()
        for send in inside_all(state, "onentry", "send"):
            event, name = send.attributes.get("event", ""), send.attributes.get("id", "")
            cancels = exits.union(*(each.elements("cancel") for each in leaving))
            cancels = {each for each in cancels if each.attributes.get("sendid") == name}
            waiting = {other for other, words in awaited if f"{event}.".startswith(f"{words}.")}
            is_own = event and (state, event) in awaited and waiting == {state} and sent[event] == 1
            if is_own and (delay := _delay(send)) and len(cancels) == cancelled[name]:
                timers[state, event] = delay
                gone |= {send, *cancels}
                if not cancels & exits:
                    message = Message("`{event}` is a timer, which ends with its state", event=event[:60])
                    report(Code.SCXML_OTHER_FORM, send, message)
        for holder in (*state.elements("onentry", "onexit"), *leaving):
            holder.children = [each for each in holder.children if each not in gone]
    return timers


def _delay(send: XmlElement) -> str:
    """Return the delay in ms of an event that is sent within the chart, blank for any other."""
    delay = send.attributes.get("delay") or send.attributes.get("delayexpr", "").strip(" '\"")
    match = _TIME.fullmatch(delay.strip())
    if match is None or not _is_own(send):
        return ""
    return f"{(Decimal(match[1]) * _MILLISECONDS[match[2]]).normalize():f}"


def is_at_once(element: XmlElement) -> bool:
    """Return whether an element sends an event within the chart without delay."""
    is_delayed = element.attributes.keys() & {"delay", "delayexpr"} and _delay(element) != "0"
    return element.tag == "raise" or (element.tag == "send" and _is_own(element) and not is_delayed)


def _is_own(send: XmlElement) -> bool:
    """Return whether an event is for the chart itself, which is not computed."""
    attributes = {name: value for name, value in send.attributes.items() if ":" not in name}
    is_here = attributes.get("target", "") in _SELF_TARGETS and attributes.get("type", "") in _SELF_TYPES
    return is_here and attributes.keys() <= _SEND_ATTRIBUTES


def _waits_for_raised(element: XmlElement) -> bool:
    return element.tag == "send" and is_at_once(element) and element.attributes.get("target") != "#_internal"


class ScriptReader:
    """Reads the code of a file. That of another `datamodel` than Python is kept, and reported."""

    def __init__(self, root: XmlElement, report: Report) -> None:
        datamodel = root.attributes.get("datamodel", "")
        is_default = datamodel.lower() in ("", "null", "ecmascript", "javascript")
        self._is_python = datamodel.lower().startswith("python")
        self._name = _ECMASCRIPT if is_default else datamodel
        self._root = root
        self._report = report
        self.language = ""
        """The language of the code read so far, blank for Python."""

    def expression(self, element: XmlElement, text: str, *, is_inline: bool = False) -> str:
        """Return an expression that may stand anywhere, blank after reporting that it is none.

        What is `inline`, between tags, may be JSON, or else is a text.
        """
        text = text.strip()
        self._check(element, text)
        if not text or not self._is_python:
            return text
        if found := (_json(text) if is_inline else "") or _expression(text):
            return found
        if not is_inline:
            message = Message("`{first}` is not a Python expression: it is not imported", first=_first(text))
            self._report_lost(element, message)
            return ""
        message = Message("`{first}` is not a Python expression: it is a text", first=_first(text))
        self._report(Code.SCXML_OTHER_FORM, element, message)
        return _quoted(" ".join(text.split()))

    def value(self, element: XmlElement) -> str:
        """Return the value of `data`, `assign` or `content`, by their `expr` or what is inside."""
        for inside in element.elements():
            self._report_lost(inside, Message("XML is not imported as a value: write it in Python"))
        text, is_inline = element.attributes.get("expr", element.text), "expr" not in element.attributes
        return self.expression(element, text, is_inline=is_inline) if text.strip() else "None"

    def condition(self, element: XmlElement) -> str:
        """Return the condition of an element, blank if it has none; one that is no Python never holds."""
        text = element.attributes.get("cond", "")
        return self.expression(element, text) or ("False" if text.strip() else "")

    def code(self, holders: Iterable[XmlElement]) -> Text:
        """Return the code in elements such as `onentry`."""
        found = [each for holder in holders for each in holder.elements()]
        self._check_order(found)
        if len(found) == 1 and found[0].tag == "script" and "src" not in found[0].attributes:
            self._script(found[0])
            return found[0].content
        text = "\n".join(self.lines(found))
        return Text(text, found[0].line, found[0].column) if text else Text()

    @cached_property
    def _sends(self) -> int:
        return sum(map(_waits_for_raised, descendants(self._root, "send")))

    def _check_order(self, elements: Sequence[XmlElement]) -> None:
        """Report raised events, unless all that is sent is sent after them: SCXML handles them before."""
        later = 0
        for element in reversed([each for found in elements for each in (found, *descendants(found))]):
            if _waits_for_raised(element):
                later += 1
            elif is_at_once(element) and later < self._sends:
                event = element.attributes.get("event", "")[:60]
                message = Message("SCXML handles `{event}` before what is sent before it", event=event)
                self._report(Code.SCXML_DIFFERENT_MEANING, element, message)

    def lines(self, elements: Iterable[XmlElement]) -> Iterator[str]:
        """Yield the lines of Python for elements of executable content."""
        for element in elements:
            attributes = element.attributes
            match element.tag:
                case "script" if "src" not in attributes:
                    yield from self._script(element)
                case "raise":
                    yield f"self.send({_quoted(decode_event(attributes.get('event', '')))})"
                case "send":
                    yield from self._send(element)
                case "log":
                    label = _quoted(attributes.get("label", ""))
                    value = self.expression(element, attributes.get("expr", ""))
                    values = ('"%s %s"', label, value) if value else ('"%s"', label)
                    yield f"self.log.info({', '.join(values)})"
                case "assign" if is_name(attributes.get("location", "").strip()):
                    if value := self.value(element):
                        yield f"{attributes['location'].strip()} = {value}"
                case "if":
                    yield from self._if(element)
                case name:
                    message = Message("`{name}` is not imported: write it in Python", name=name[:60])
                    self._report_lost(element, message)

    def _send(self, element: XmlElement) -> Iterator[str]:
        event, attributes = element.attributes.get("event", ""), element.attributes
        if attributes.keys() & {"delay", "delayexpr"} and _delay(element) != "0":
            message = Message("`{event}` is not imported: it is delayed, but no timer", event=event[:60])
            self._report_lost(element, message)
            return
        is_plain = _is_own(element)
        data = {name: self.expression(element, name) for name in attributes.get("namelist", "").split()}
        content = ""
        for item in element.elements():
            value = item.attributes.get("expr") or item.attributes.get("location", "")
            if item.tag == "content":
                content = self.value(item)
            else:
                data[item.attributes.get("name", "")] = self.expression(item, value)
            is_plain &= item.tag == "content" or (item.tag == "param" and bool(value.strip()))
        if not event or not is_plain:
            message = Message("an event for other programs, or with a computed name, is not imported")
            self._report_lost(element, message)
            return
        pairs = ", ".join(f"{_quoted(name)}: {value}" for name, value in data.items() if value)
        values = content or (f"{{{pairs}}}" if pairs else "")
        yield f"self.send({', '.join(filter(None, (_quoted(decode_event(event)), values)))})"

    def _if(self, element: XmlElement) -> Iterator[str]:
        branch: list[XmlElement] = []
        yield f"if {self.condition(element) or 'True'}:"
        for child in element.elements():
            if child.tag not in ("elseif", "else"):
                branch.append(child)
                continue
            yield from self._block(branch)
            branch = []
            yield f"elif {self.condition(child) or 'True'}:" if child.tag == "elseif" else "else:"
        yield from self._block(branch)

    def _block(self, elements: Iterable[XmlElement]) -> Iterator[str]:
        text = "\n".join(self.lines(elements))
        tree = parse_piece(text)
        code = split(Text(text if tree is None or tree.body else f"{text}\npass"))
        yield from () if code is None else code.indented(1)

    def _script(self, element: XmlElement) -> Sequence[str]:
        """Return the lines of a script, after reporting what cannot run."""
        self._check(element, element.text)
        code = split(element.content)
        lines = () if code is None else code.lines
        if self._is_python and parse_piece("\n".join((*lines, "pass"))) is None:
            message = Message(
                "`{first}` is not valid Python: it is kept, but cannot run", first=_first(lines[0])
            )
            self._report(Code.KEPT_LANGUAGE, element, message)
        return lines

    def _check(self, element: XmlElement, text: str) -> None:
        """Report code that cannot run here."""
        if not self._is_python and text.strip():
            self.language = self._name
            message = Message(
                "`{first}` is {language}: it is kept, but cannot run until it is translated to Python",
                first=_first(text),
                language=self._name,
            )
            self._report(Code.KEPT_LANGUAGE, element, message)
        elif (name := _SYSTEM_NAMES.search(text)) is not None:
            message = Message("`{name}` does not exist here: the code would raise NameError", name=name[0])
            self._report_lost(element, message)

    def _report_lost(self, element: XmlElement, message: Message) -> None:
        self._report(Code.SCXML_NOT_IMPORTED, element, message)


def first_words(event: str) -> str:
    """Return the words with which the events begin that a transition takes for `event`, blank for all."""
    return event.removesuffix("*").rstrip(".")


def decode_event(name: str) -> str:
    """Return the name of an event without the writer's encoding: `_x0020_` is a space."""
    return _ENCODED.sub(_decoded, name)


def is_name(text: str) -> bool:
    """Return whether a text is a valid name of a variable."""
    return text.isascii() and text.isidentifier() and not keyword.iskeyword(text)


def _json(text: str) -> str:
    """Return JSON with words that Python does not have as Python, blank for any other text."""
    try:
        return _expression(repr(json.loads(text))) if _JSON_WORDS.search(text) else ""
    except (ValueError, RecursionError):
        return ""


def _expression(text: str) -> str:
    """Return an expression, in parentheses where it needs them beside other code; blank if it is none."""
    try:
        with warnings.catch_warnings(action="ignore"):
            compile(f"({text}\n)", "", "eval")
            inside = ast.parse(f"[{text}\n]", mode="eval").body  # not if it closes brackets itself
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ""
    if not isinstance(inside, ast.List) or not inside.elts:
        return ""
    match parse_piece(f"_ = 0, {text}, 0"):
        case ast.Module(body=[ast.Assign(value=ast.Tuple(elts=[_, _, _]))]):
            return text
    return f"({text}\n)"


def _first(text: str) -> str:
    """Return the beginning of a text for a message."""
    return text.strip().partition("\n")[0][:60]


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _decoded(match: re.Match[str]) -> str:
    code = int(match[1], 16)
    return chr(code) if code <= 0x10FFFF and not UNWRITABLE.search(chr(code)) else match[0]
