"""Read what stands inside the states of SCXML: namespaces, findings, and code that becomes Python."""

from __future__ import annotations

import ast
import json
import re
import textwrap
from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics, Location, Note

from ..codes import Code
from ..document import Text
from ..formats.xml_tree import XmlElement
from .vocabulary import (
    OWN_NAMESPACE,
    OWN_PREFIX,
    SCXML_NAMESPACE,
    decode_event,
    expression_of,
    is_name,
)

__all__ = ["OTHER", "CodeReader", "Findings", "everywhere", "inside", "resolve_namespaces"]

OTHER: Final = "?"
"""Stands before the tag of an element that belongs to another program."""

_ECMASCRIPT: Final = "ECMAScript"
_WORDS: Final = re.compile(r"""'[^'\\\n]*'|"[^"\\\n]*"|[\w$.]+|\s*(?:&&|\|\|)\s*|[=!]==""")
_IN_PYTHON: Final = {"true": "True", "false": "False", "===": "==", "!==": "!="}
_OPERATORS: Final = {"&&": " and ", "||": " or "}
_NOT_NAMES: Final = frozenset(("undefined", "null", "NaN", "Infinity", "In", "_event", "this"))
_SYSTEM_NAMES: Final = re.compile(r"\b(?:In(?=\()|_event\b|_sessionid\b|_name\b|_ioprocessors\b)")
_SELF_TARGETS: Final = ("", "#_internal", "#_scxml")
_COMPUTED: Final = frozenset(("targetexpr", "typeexpr", "idlocation", "namelist", "eventexpr", "type"))
_COMMON: Final = (
    *(ast.Expression, ast.BoolOp, ast.And, ast.Or, ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.USub, ast.Load),
    *(ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE),
)


def resolve_namespaces(root: XmlElement) -> bool:
    """Rename all elements by their namespaces, and return whether any name is of ours.

    Elements of SCXML lose their prefix, ours get the prefix `hfsm:`, as do our attributes, and those of other
    programs get `?` before their names. Without any namespace an element is SCXML's.
    """
    has_own = False
    pending = [(root, {"": SCXML_NAMESPACE})]
    while pending:
        element, around = pending.pop()
        declared = {
            name.partition(":")[2]: value
            for name, value in element.attributes.items()
            if name == "xmlns" or name.startswith("xmlns:")
        }
        namespaces = {**around, **declared}
        prefix, _, local = element.tag.rpartition(":")
        namespace = namespaces.get(prefix)
        if namespace == SCXML_NAMESPACE or (prefix == "" and not namespace):
            element.tag = local
        elif namespace == OWN_NAMESPACE:
            element.tag = f"{OWN_PREFIX}:{local}"
            has_own = True
        else:
            element.tag = OTHER + element.tag
        for name, value in list(element.attributes.items()):
            space, _, local = name.rpartition(":")
            if space and namespaces.get(space) == OWN_NAMESPACE:
                element.attributes[f"{OWN_PREFIX}:{local}"] = value
                has_own = True
        pending += [(child, namespaces) for child in element.elements()]
    return has_own


def inside(element: XmlElement, *tags: str) -> Iterator[XmlElement]:
    """Yield the elements with these tags, or all of SCXML, directly inside an element."""
    for child in element.elements():
        if child.tag in tags or (not tags and not child.tag.startswith((OTHER, f"{OWN_PREFIX}:"))):
            yield child


def everywhere(element: XmlElement, *tags: str) -> Iterator[XmlElement]:
    """Yield the elements with these tags at any depth inside an element."""
    for child in element.elements():
        if child.tag in tags:
            yield child
        yield from everywhere(child, *tags)


class Findings:
    """Reports what is found in one file; `failed` says that it is no valid SCXML."""

    def __init__(self, path: Path, diagnostics: Diagnostics) -> None:
        self._path = path
        self._diagnostics = diagnostics
        self.failed = False

    def invalid(self, element: XmlElement, message: str, notes: Iterable[Note] = ()) -> None:
        """Report what makes the file no SCXML."""
        self.failed = True
        self._diagnostics.error(Code.INVALID_SCXML, message, self._place(element), notes)

    def lost(self, element: XmlElement, message: str) -> None:
        """Report what is not carried."""
        self._diagnostics.warning(Code.SCXML_NOT_CARRIED, message, self._place(element))

    def approximate(self, element: XmlElement, message: str) -> None:
        """Report what is carried, but means something else in some cases."""
        self._diagnostics.warning(Code.SCXML_NOT_THE_SAME, message, self._place(element))

    def note(self, code: str, element: XmlElement, message: str) -> None:
        """Report what is carried in another shape (N561), of others (N562), or not in Python (N502)."""
        self._diagnostics.note(code, message, self._place(element))

    def _place(self, element: XmlElement) -> Location:
        return Location(self._path, element.line, element.column, len(element.tag) + 1)


class CodeReader:
    """Translates the code of a file into Python.

    A `datamodel` that is not Python has expressions that mean the same in Python, which are translated. Any
    other code is kept and reported: then the document is in `language`. `has_own` says that we have written
    the file.
    """

    def __init__(self, datamodel: str, findings: Findings, *, has_own: bool) -> None:
        is_default = datamodel.lower() in ("", "null", "ecmascript", "javascript")
        self._is_python = datamodel.lower().startswith("python")
        self._name = _ECMASCRIPT if is_default else datamodel
        self._findings = findings
        self._has_own = has_own
        self.language = ""
        """The language of the code that was read so far, blank for Python."""

    def event(self, name: str) -> str:
        """Return the native name of an event."""
        return decode_event(name) if self._has_own else name

    def expression(self, element: XmlElement, text: str) -> str:
        """Return an expression in Python, or as it is; `element` is where it stands."""
        python = None if self._is_python else _translated(text)
        if python is None:
            self._check(element, text)
        return text if python is None else python

    def script(self, element: XmlElement) -> list[str]:
        """Return the lines of a script."""
        self._check(element, element.text)
        return textwrap.dedent(element.text).strip("\n").split("\n")

    def code(self, holders: Sequence[XmlElement], consumed: Collection[XmlElement] = ()) -> Text:
        """Return the code in elements such as `onentry`, without those that were understood otherwise."""
        found = [each for holder in holders for each in inside(holder) if each not in consumed]
        if len(found) == 1 and found[0].tag == "script" and "src" not in found[0].attributes:
            self._check(found[0], found[0].text)
            return Text(found[0].text, found[0].text_line, found[0].text_column)
        place = next(iter((*found, *holders)), None)
        text = "\n".join(self._statements(found))
        return Text(text, place.line, place.column) if text and place is not None else Text(text)

    def _statements(self, elements: Iterable[XmlElement]) -> Iterator[str]:
        for element in elements:
            attributes = element.attributes
            match element.tag:
                case "script" if "src" not in attributes:
                    yield from self.script(element)
                case "raise":
                    yield f"self.send({_quoted(self.event(attributes.get('event', '')))})"
                case "send":
                    yield from self._send(element)
                case "log":
                    yield self._log(element)
                case "assign" if is_name(attributes.get("location", "").strip()):
                    text = attributes.get("expr", element.text).strip()
                    value = self.expression(element, text) if text else "None"
                    yield f"{attributes['location'].strip()} = {value}"
                case "if":
                    yield from self._if(element)
                case "foreach" if is_name(attributes.get("item", "").strip()):
                    item, index = attributes["item"].strip(), attributes.get("index", "").strip()
                    array = self.expression(element, attributes.get("array", "").strip() or "()")
                    is_counted = is_name(index)
                    yield (
                        f"for {index}, {item} in enumerate({array}):"
                        if is_counted
                        else f"for {item} in {array}:"
                    )
                    yield from self._block(inside(element))
                case name:
                    self._findings.lost(element, f"`{name}` is not carried: write in Python what it does")

    def _send(self, element: XmlElement) -> Iterator[str]:
        attributes = element.attributes
        event = attributes.get("event", "")
        if "delay" in attributes or "delayexpr" in attributes:
            message = f"the delayed event `{event[:60]}` is not carried: only the state itself has timers"
            self._findings.lost(element, message)
            return
        is_plain = attributes.get("target", "") in _SELF_TARGETS and not attributes.keys() & _COMPUTED
        data: list[str] = []
        for item in inside(element):
            name, value = item.attributes.get("name", ""), item.attributes.get("expr", "").strip()
            is_plain &= item.tag == "param" and bool(value)
            data.append(f"{_quoted(name)}: {self.expression(item, value)}")
        if not event or not is_plain:
            self._findings.lost(element, "an event for others, or of a computed name, is not carried")
            return
        values = f", {{{', '.join(data)}}}" if data else ""
        yield f"self.send({_quoted(self.event(event))}{values})"

    def _log(self, element: XmlElement) -> str:
        label, value = element.attributes.get("label", ""), element.attributes.get("expr", "").strip()
        if not value:
            return f'self.log.info("%s", {_quoted(label)})'
        return f'self.log.info("%s %s", {_quoted(label)}, {self.expression(element, value)})'

    def _if(self, element: XmlElement) -> Iterator[str]:
        branch: list[XmlElement] = []
        yield f"if {self._condition(element)}:"
        for child in inside(element):
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
        lines = list(self._statements(elements))
        yield from (f"    {line}" if line else line for line in lines or ["pass"])

    def _check(self, element: XmlElement, text: str) -> None:
        """Report code that does not run here."""
        if not self._is_python and text.strip():
            self.language = self._name
            first = text.strip().partition("\n")[0][:60]
            message = (
                f"`{first}` is {self._name}: it is kept, and does not run before it is written in Python"
            )
            self._findings.note(Code.KEPT_LANGUAGE, element, message)
        elif not self._has_own and (name := _SYSTEM_NAMES.search(text)) is not None:
            self._findings.lost(element, f"`{name[0]}` does not exist here: the code stops with a NameError")


def _translated(text: str) -> str | None:
    """Return an expression of ECMAScript that has the same parts in Python; None for any other."""
    python = _WORDS.sub(
        lambda match: _IN_PYTHON.get(match[0]) or _OPERATORS.get(match[0].strip(), match[0]), text.strip()
    )
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
