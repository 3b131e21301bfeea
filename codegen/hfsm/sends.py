"""Find which events code sends, under any name of the component, and where that is uncertain."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from ..diagnostics import Location, Note
from .analysis import Analysis
from .code.text import all_nodes

__all__ = ["Sends", "sends_of", "unclear_sends"]

_SEND: Final = frozenset({"send", "_hfsm_send"})
_BY_NAME: Final = frozenset({"getattr", "attrgetter", "methodcaller", "__getattribute__"})
"""Functions that read an attribute whose name is an argument."""
_ANYTHING: Final = frozenset({"eval", "exec", "vars", "getmembers"})
_ANY_ATTRIBUTE: Final = frozenset({"__dict__", "__getattribute__", "__getattr__"})
_LOADERS: Final = frozenset({"__import__", "import_module"})
_KNOWN_LIBRARIES: Final = sys.stdlib_module_names | {
    "cv2",
    "numpy",
    "scipy",
    "PIL",
    "interfaces",
    "zenoh_ice",
}
"""Libraries that send no events, whatever their arguments."""
_HARMLESS: Final = frozenset({"print", "repr", "str", "id", "isinstance", "hasattr", "getattr", "type"})


@dataclass(frozen=True, slots=True)
class Sends:
    """The events that code certainly sends; from the line `unclear` on it may send others.

    With `self_escapes` it gives the component another name or passes it on, perhaps to a library.
    """

    names: frozenset[str] = frozenset()
    unclear: int | None = None
    self_escapes: bool = False


def unclear_sends(analysis: Analysis) -> list[Note]:
    """Return notes about code of a document that may send any event."""
    found = []
    if analysis.extension is not None:
        place = Location(analysis.path)
        found.append(Note("the hand-written extension may send any event", place))
    modules = {module.split(".")[0] for module in analysis.modules}
    unknown = not modules <= _KNOWN_LIBRARIES
    for text, path, piece in analysis.by_text.values():
        sends = _BROKEN if piece is None else sends_of(piece.tree)
        if sends.unclear is not None or (unknown and sends.self_escapes):
            line = (sends.unclear or 1) - (0 if piece is None else piece.header)
            place = Location(path, max(1, text.line), max(1, text.column))
            if piece is not None and line > 1:
                place = Location(path, max(1, piece.code.line + line - 1))
            found.append(Note("this code may send any event", place))
    return found


_BROKEN: Final = Sends(unclear=1)


@lru_cache(maxsize=4096)
def sends_of(tree: ast.Module) -> Sends:
    """Return the events that a piece of Python sends."""
    names: set[str] = set()
    lines: list[int] = []
    understood: set[ast.AST] = set()
    for node in all_nodes(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in _SEND:
            understood.add(node.func)
            found, clear = _sent(node, node.func)
            names |= found
            if not clear:
                lines.append(node.lineno)
        elif node not in understood and _may_send(node):
            lines.append(getattr(node, "lineno", 1))
    return Sends(frozenset(names), min(lines, default=None), any(_self_escapes(tree)))


def _sent(call: ast.Call, function: ast.Attribute) -> tuple[set[str], bool]:
    """Return the events that a call of `send` sends, and whether the list is complete."""
    arguments = list(call.args)
    if not _is_self(function.value) and arguments and _is_self(arguments[0]):
        del arguments[0]  # `Component.send(self, "x")`
    name = arguments[0] if arguments else next((k.value for k in call.keywords if k.arg == "name"), None)
    if name is None:
        return set(), not any(keyword.arg is None for keyword in call.keywords)
    values = _values(name)
    return {value.strip() for value in values or () if isinstance(value, str)}, values is not None


def _values(node: ast.expr) -> list[object] | None:
    """Return the possible values of an expression, or None if they are unknown."""
    if isinstance(node, ast.Constant):
        return [node.value]
    if not isinstance(node, ast.IfExp):
        return None
    first, second = _values(node.body), _values(node.orelse)
    return None if first is None or second is None else first + second


def _may_send(node: ast.AST) -> bool:
    """Return whether a node that is not a plain call of `send` may call it."""
    match node:
        case ast.Attribute(value=ast.Name(id="builtins" | "__builtins__")):
            return True
        case ast.Attribute(attr=attribute):
            return attribute in _SEND | _ANY_ATTRIBUTE | _LOADERS | {"getmembers"}
        case ast.Constant(value=str() as value):
            return value in _SEND
        case ast.Name(id=name):
            return name in _ANYTHING | _LOADERS
        case ast.MatchClass(kwd_attrs=attributes):
            return bool(_SEND.intersection(attributes))
        case ast.alias(name=name):
            return name in _ANYTHING | _LOADERS | _BY_NAME
        case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
            return name in _SEND  # what it does with its arguments is unknown
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=arguments) if name in _BY_NAME:
            place = 1 if name == "getattr" else 0
            return not arguments[place:] or not all(
                _is_another(each) for each in arguments[place : place + 1]
            )
    return False


def _is_another(name: ast.expr) -> bool:
    """Return whether the name of an attribute, which may be computed, is certainly not `send`."""
    match name:
        case ast.Constant(value=str() as value):
            return value not in _SEND
        case ast.JoinedStr(values=[first, *_, last]) | ast.BinOp(op=ast.Add(), left=first, right=last):
            start, end = (part.value if isinstance(part, ast.Constant) else "" for part in (first, last))
            return not any(each.startswith(str(start)) and each.endswith(str(end)) for each in _SEND)
    return False


def _self_escapes(tree: ast.AST) -> Iterator[bool]:
    """Yield for each use of the component itself whether it is passed on or gets another name."""
    harmless: set[ast.AST] = set()
    names = {"self"}
    for node in all_nodes(tree):
        match node:
            case ast.FunctionDef(args=ast.arguments(args=[first, *_])):
                names.add(first.arg)
            case ast.Attribute(value=value):
                harmless.add(value)
            case ast.Call(func=ast.Name(id=name), args=arguments) if name in _HARMLESS:
                harmless.update(arguments)
    for node in all_nodes(tree):
        yield isinstance(node, ast.Name) and node.id in names and node not in harmless


def _is_self(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "self"
