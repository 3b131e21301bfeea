"""Find code that may take longer than a period: it sleeps, waits, or cannot be followed.

While a cycle lasts, others fall due and are missed, so that timers that expire one after the other in the
model may expire together. What only computes, and calls of servants, are taken to end within a period.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Iterator, Mapping
from typing import Final

from ...diagnostics import Location, Note
from ...messages import Message
from ..analysis import Analysis, Piece, names_with
from ..code.text import all_nodes, dotted, full_name

_QUICK_MODULES: Final = frozenset(
    {
        *("base64", "bisect", "builtins", "cmath", "collections", "colorsys", "copy", "cv2", "dataclasses"),
        *("datetime", "decimal", "enum", "fractions", "functools", "hashlib", "heapq", "interfaces"),
        *("itertools", "jderobot", "json", "logging", "math", "numpy", "operator", "random", "re"),
        *("statistics", "string", "struct", "sys", "textwrap", "threading", "time", "traceback", "types"),
        *("typing", "uuid", "weakref", "zlib"),
    }
)
"""Modules whose functions only compute. Those that wait nevertheless are found by their names."""
_QUICK_PACKAGES: Final = ("os.path.",)
_WAITING_FUNCTIONS: Final = frozenset({"cv2.waitKey", "cv2.waitKeyEx", "cv2.pollKey"})
_WAITING_BUILTINS: Final = frozenset(
    {"__import__", "compile", "eval", "exec", "globals", "input", "locals", "vars"}
)
"""They wait for a person, or call functions that are not known."""
_WAITING_METHODS: Final = frozenset(
    {
        *("__enter__", "accept", "acquire", "communicate", "connect", "next", "put", "readline", "recv"),
        *("recvfrom", "result", "samples", "select", "wait", "wait_for"),
    }
)
_NAMED_METHODS: Final = frozenset({"acquire", "samples", "wait", "wait_for"})
"""Those that wait even where code only names them: it may call them by another name."""
_BY_NAME: Final = frozenset({"attrgetter", "getattr", "methodcaller"})
"""Functions that find a method by its name."""
_GIVING_TEXTS: Final = frozenset({"filter", "list", "map", "reversed", "set", "sorted", "str", "tuple"})
_ENDLESS: Final = frozenset({"itertools.count", "itertools.cycle", "itertools.repeat"})
_STANDARD_INPUT: Final = "sys.stdin"
_BUILTINS: Final = frozenset(dir(builtins))
_SLEEP: Final = "sleep"


def slow_code(analysis: Analysis) -> tuple[Note, ...]:
    """Return the places of code that may take longer than a period, at most one for each piece of code."""
    extension = analysis.extension
    finder = _Finder(
        analysis.libraries,
        has_own_sleep=_SLEEP in analysis.defined,
        has_threads="threading" in analysis.modules,
        handwritten=frozenset() if extension is None else extension.attributes,
    )
    found = []
    for text, path, piece in analysis.by_text.values():
        if piece is None:
            continue  # the component cannot be generated
        node = next(finder.slow(piece), None)
        if piece.is_deep:
            found.append(Note(_MESSAGE, Location(path, max(1, text.line), max(1, text.column))))
        elif node is not None:
            found.append(Note(_MESSAGE, piece.place(node)))
    return tuple(found)


_MESSAGE: Final = Message("this code may take longer than a period, and timers may expire in any order")


class _Finder:
    def __init__(
        self,
        libraries: Mapping[str, str],
        *,
        has_own_sleep: bool,
        has_threads: bool,
        handwritten: frozenset[str],
    ) -> None:
        self._libraries = libraries
        self._has_threads = has_threads
        self._has_own_sleep = has_own_sleep
        self._handwritten = handwritten

    def slow(self, piece: Piece) -> Iterator[ast.AST]:
        """Yield the nodes of a piece of code that may take longer than a period."""
        modules = names_with(self._libraries, all_nodes(piece.tree))
        for node in all_nodes(piece.tree):
            if self._is_slow(node, modules):
                yield node

    def _is_slow(self, node: ast.AST, modules: Mapping[str, str]) -> bool:
        match node:
            case ast.While() | ast.AsyncFor() | ast.AsyncWith() | ast.Await():
                return True
            case ast.For(iter=ast.Call() as call) | ast.comprehension(iter=ast.Call() as call):
                return self._is_endless(call, modules)
            case ast.With(items=items):  # a lock waits; what a library returns was found by that call
                return any(self._may_be_lock(item.context_expr, modules) for item in items)
            case ast.Constant(value="sleep"):  # the name of an attribute
                return True
            case ast.Attribute(value=ast.Name("self"), attr="sleep"):
                return not self._has_own_sleep
            case ast.Attribute(attr="sleep"):
                return True
            case ast.Attribute(attr=name, ctx=ast.Load()):
                module, *others = dotted(node) or [""]
                if module == "self" and len(others) < 2:  # what it was given was found where it got it
                    return name in self._handwritten
                if name in _NAMED_METHODS:
                    return True
                full = ".".join([modules.get(module, ""), *others])
                return full == _STANDARD_INPUT or (full == f"builtins.{name}" and name in _WAITING_BUILTINS)
            case ast.Name(id=name):
                full = modules.get(name, name)
                last = full.split(".")[-1]
                return full == _STANDARD_INPUT or last == _SLEEP or last in _WAITING_BUILTINS
            case ast.Call():
                return self._may_wait(node, modules)
        return False

    def _is_endless(self, call: ast.Call, modules: Mapping[str, str]) -> bool:
        """Return whether only the body of a loop over what a call returns ends it, as with `while`."""
        name = full_name(call.func, modules)
        return (name == "iter" and len(call.args) == 2) or name in _ENDLESS

    def _may_wait(self, call: ast.Call, modules: Mapping[str, str]) -> bool:
        if isinstance(call.func, ast.Attribute) and self._waits(call.func, call):
            return True
        if not _BY_NAME.isdisjoint(dotted(call.func)[-1:]) and _names_what_waits(call):
            return True
        if isinstance(call.func, ast.Name) and call.func.id == "getattr":
            return len(call.args) < 2 or _may_be_sleep(call.args[1])
        first, *others = dotted(call.func) or [""]
        if first == "self":
            return False
        if first not in modules and (others or "*" not in modules or first in _BUILTINS):
            return False
        name = ".".join([modules.get(first, modules.get("*", "")), *others])
        if name in _WAITING_FUNCTIONS:
            return True
        return name.split(".")[0] not in _QUICK_MODULES and not name.startswith(_QUICK_PACKAGES)

    def _waits(self, function: ast.Attribute, call: ast.Call) -> bool:
        """Return whether a method, whose object is not known, may wait."""
        arguments = len(call.args) + len(call.keywords)
        match function.attr:
            case "get":  # of a queue, not of a dictionary
                return not call.args or any(each.arg in ("block", "timeout", None) for each in call.keywords)
            case "join":  # of a thread, not of a text
                is_text = isinstance(function.value, ast.Constant)
                may_be_time = _is_number(call) or (self._has_threads and not _are_texts(call))
                return not is_text and (arguments == 0 or may_be_time)
            case name:
                return name in _WAITING_METHODS

    def _may_be_lock(self, node: ast.expr, modules: Mapping[str, str]) -> bool:
        """Return whether what a `with` enters may be a lock: code of the document may return one."""
        if not isinstance(node, ast.Call):
            return True
        first = (dotted(node.func) or [""])[0]
        return self._has_threads and first not in modules and first not in _BUILTINS


def _may_be_sleep(name: ast.expr) -> bool:
    """Return whether the computed name of an attribute may be `sleep`; a constant one is found as such."""
    match name:
        case ast.Constant():
            return False
        case ast.JoinedStr(values=parts):
            return all(str(part.value) in _SLEEP for part in parts if isinstance(part, ast.Constant))
    return True


def _is_number(call: ast.Call) -> bool:
    match call:
        case ast.Call(args=[ast.Constant(value=int() | float())]):
            return True
    return any(each.arg in ("timeout", None) for each in call.keywords)


def _are_texts(call: ast.Call) -> bool:
    """Return whether a call has an argument that certainly is no time: what a text joins."""
    shown = ast.List | ast.Tuple | ast.Set | ast.ListComp | ast.SetComp | ast.GeneratorExp
    names = [dotted(each.func)[-1:] for each in call.args if isinstance(each, ast.Call)]
    return any(isinstance(each, shown) for each in call.args) or any(
        name[0] in _GIVING_TEXTS for name in names if name
    )


def _names_what_waits(call: ast.Call) -> bool:
    """Return whether an argument of a call is the name of a method that waits."""
    texts = [
        each.value for each in call.args if isinstance(each, ast.Constant) and isinstance(each.value, str)
    ]
    return any(text.split(".")[-1] in (*_WAITING_METHODS, "join") for text in texts)
