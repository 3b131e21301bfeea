"""Read the code of SCXML: conditions, expressions and executable content become Python."""

from __future__ import annotations

import ast
import json
import re
import textwrap
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Final

from ..formats.xml_tree import XmlElement
from .data import expression_of, is_name
from .problems import Problems
from .qualified import QualifiedTree
from .vocabulary import decode_event

__all__ = ["CodeReader"]

_ECMASCRIPT: Final = "ECMAScript"
_WORDS: Final = re.compile(r"""'[^'\\\n]*'|"[^"\\\n]*"|[\w$.]+|\s*(?:&&|\|\|)\s*|[=!]==""")
_IN_PYTHON: Final = {"true": "True", "false": "False", "===": "==", "!==": "!="}
_OPERATORS: Final = {"&&": " and ", "||": " or "}
_NOT_NAMES: Final = frozenset(("undefined", "null", "NaN", "Infinity", "In", "_event", "this"))
_SELF_TARGETS: Final = ("", "#_internal", "#_scxml")


class CodeReader:
    """Make Python of the code of a file.

    A `datamodel` that is not Python has expressions that mean the same in Python, which are taken as they
    stand. Any other code is kept, and told: then the document is in `language`.
    """

    def __init__(self, datamodel: str, tree: QualifiedTree, problems: Problems) -> None:
        self._is_python = datamodel.lower().startswith("python")
        self._name = (
            _ECMASCRIPT if datamodel.lower() in ("", "null", "ecmascript", "javascript") else datamodel
        )
        self._tree = tree
        self._problems = problems
        self._has_foreign = False

    @property
    def language(self) -> str:
        """The language of the code that was read so far, blank for Python."""
        return self._name if self._has_foreign else ""

    def keep(self) -> None:
        """Take all code as it stands, since the document itself says its language."""
        self._is_python = True

    def event(self, name: str) -> str:
        """Return the native name of an event."""
        return decode_event(name) if self._tree.has_own else name

    def expression(self, element: XmlElement, text: str) -> str:
        """Return an expression in Python, or as it is; `element` is where it stands."""
        if self._is_python:
            return text
        python = _translated(text)
        if python is None:
            self._foreign(element, text)
        return text if python is None else python

    def script(self, element: XmlElement) -> list[str]:
        """Return the lines of a script."""
        self._check(element)
        return textwrap.dedent(element.text).strip("\n").split("\n")

    def of(
        self, holders: Sequence[XmlElement], consumed: Collection[XmlElement] = ()
    ) -> tuple[str, XmlElement | None]:
        """Return the code in elements such as `onentry`, and the element that its text comes from, if one.

        What is `consumed` has been understood otherwise.
        """
        found = [each for holder in holders for each in self._tree.inside(holder) if each not in consumed]
        if len(found) == 1 and self._tree.scxml(found[0]) == "script" and "src" not in found[0].attributes:
            self._check(found[0])
            return found[0].text, found[0]
        return "\n".join(self._lines(found)), found[0] if found else None

    def _lines(self, elements: Iterable[XmlElement]) -> Iterator[str]:
        for element in elements:
            attributes = element.attributes
            match self._tree.scxml(element):
                case "script" if "src" not in attributes:
                    yield from self.script(element)
                case "raise":
                    yield f"self.send({_quoted(self.event(attributes.get('event', '')))})"
                case "send":
                    yield from self._send(element)
                case "log":
                    yield self._log(element)
                case "assign" if is_name(attributes.get("location", "").strip()):
                    value = self._value(element)
                    yield f"{attributes['location'].strip()} = {value}"
                case "if":
                    yield from self._if(element)
                case "foreach" if is_name(attributes.get("item", "").strip()):
                    yield from self._foreach(element)
                case name:
                    self._problems.lost(element, f"`{name}` is not carried: write in Python what it does")

    def _check(self, element: XmlElement) -> None:
        if not self._is_python and element.text.strip():
            self._foreign(element, element.text)

    def _value(self, element: XmlElement) -> str:
        text = element.attributes.get("expr", element.text).strip()
        return self.expression(element, text) if text else "None"

    def _send(self, element: XmlElement) -> Iterator[str]:
        attributes = element.attributes
        event = attributes.get("event", "")
        if "delay" in attributes or "delayexpr" in attributes:
            message = (
                f"the delayed event `{event[:60]}` is not carried: here only the state itself has timers"
            )
            self._problems.lost(element, message)
            return
        is_plain = attributes.get("target", "") in _SELF_TARGETS and not attributes.keys() & {
            *("targetexpr", "typeexpr", "idlocation", "namelist", "eventexpr", "type"),
        }
        data: list[str] = []
        for item in self._tree.inside(element):
            name, value = item.attributes.get("name", ""), item.attributes.get("expr", "").strip()
            is_plain &= self._tree.scxml(item) == "param" and bool(value)
            data.append(f"{_quoted(name)}: {self.expression(item, value)}")
        if not event or not is_plain:
            self._problems.lost(element, "an event for others, or of a name that is computed, is not carried")
            return
        values = f", {{{', '.join(data)}}}" if data else ""
        yield f"self.send({_quoted(self.event(event))}{values})"

    def _log(self, element: XmlElement) -> str:
        label, value = element.attributes.get("label", ""), element.attributes.get("expr", "").strip()
        if not value:
            return f'self.log.info("%s", {_quoted(label)})'
        expression = self.expression(element, value)
        return f'self.log.info("%s %s", {_quoted(label)}, {expression})'

    def _if(self, element: XmlElement) -> Iterator[str]:
        branch: list[XmlElement] = []
        yield f"if {self._condition(element)}:"
        for child in self._tree.inside(element):
            name = self._tree.scxml(child)
            if name not in ("elseif", "else"):
                branch.append(child)
                continue
            yield from self._block(branch)
            branch = []
            yield f"elif {self._condition(child)}:" if name == "elseif" else "else:"
        yield from self._block(branch)

    def _condition(self, element: XmlElement) -> str:
        return self.expression(element, element.attributes.get("cond", "").strip() or "True")

    def _foreach(self, element: XmlElement) -> Iterator[str]:
        attributes = element.attributes
        item, index = attributes["item"].strip(), attributes.get("index", "").strip()
        array = self.expression(element, attributes.get("array", "").strip() or "()")
        yield f"for {index}, {item} in enumerate({array}):" if is_name(index) else f"for {item} in {array}:"
        yield from self._block(list(self._tree.inside(element)))

    def _block(self, elements: Iterable[XmlElement]) -> Iterator[str]:
        lines = list(self._lines(elements))
        yield from (f"    {line}" if line else line for line in lines or ["pass"])

    def _foreign(self, element: XmlElement, text: str) -> None:
        self._has_foreign = True
        first = text.strip().partition("\n")[0][:60]
        message = f"`{first}` is {self._name}: it is kept, and does not run before it is written in Python"
        self._problems.foreign_code(element, message)


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
    common = (
        ast.Expression,
        ast.BoolOp,
        ast.And,
        ast.Or,
        ast.BinOp,
        ast.Add,
        ast.Sub,
        ast.Mult,
        ast.USub,
        ast.Load,
    )
    comparisons = (ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE)
    return isinstance(node, (*common, *comparisons))


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
