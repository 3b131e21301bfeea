"""Know whether a guard answers the same when it is asked again in one cycle, and whether that changes others.

Functions of the document are followed. Of what cannot be followed nothing is known: functions of libraries,
methods and attributes of objects, attributes of the component that others assign.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from enum import IntEnum
from typing import Final

from ..document import Automaton, Document, Transition
from .python import analyze_library
from .text import CodeError
from .trees import parse_piece, parse_python

__all__ = ["Answer", "Answers"]


class Answer(IntEnum):
    """What a guard answers when it is asked for the second time in one cycle.

    OTHER ones draw lots, read a sensor, or take something away.
    """

    SAME = 0
    UNKNOWN = 1
    OTHER = 2


_PURE: Final = frozenset({"abs", "bool", "float", "int", "isinstance", "len", "round", "str"})
_PURE_OF_SEVERAL: Final = frozenset({"max", "min"})
"""A single argument of theirs may be a generator."""
_PURE_METHODS: Final = frozenset({"endswith", "isalpha", "isdigit", "lower", "startswith", "strip", "upper"})
_DRAWING_LIBRARIES: Final = ("random.", "secrets.", "uuid.", "numpy.random.", "os.urandom")
_DRAWING: Final = frozenset({"choice", "gauss", "rand", "randint", "randn", "random", "randrange", "uniform"})
_TAKING: Final = frozenset({"next", "pop", "popleft", "read", "readline", "recv", "get_nowait", "shuffle"})
_PLAIN: Final = (
    *(ast.expr_context, ast.boolop, ast.operator, ast.unaryop, ast.cmpop, ast.keyword, ast.Starred),
    *(ast.Module, ast.Constant, ast.BoolOp, ast.UnaryOp, ast.BinOp, ast.Compare, ast.IfExp, ast.Subscript),
    *(ast.Tuple, ast.List, ast.Set, ast.Dict, ast.JoinedStr, ast.FormattedValue, ast.Slice),
    *(ast.Return, ast.Expr, ast.If, ast.Pass, ast.Assign, ast.AnnAssign, ast.Raise, ast.Assert),
)
_HARMLESS_SPECIAL: Final = frozenset(
    {"__init__", "__post_init__", "__repr__", "__enter__", "__exit__", "__call__"}
)
_DEFINITIONS: Final = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef

_Found = tuple[Answer, bool]
"""An answer, and whether asking may change what others answer."""
_STEADY: Final = (Answer.SAME, False)
_UNKNOWN: Final = (Answer.UNKNOWN, True)


class Answers:
    """What the guards of a document answer."""

    def __init__(self, document: Document, *, has_extension: bool = False) -> None:
        self._proxies = {interface.name for interface in document.interfaces}
        self._functions: dict[str, list[ast.stmt]] = {}
        self._libraries: dict[str, str] = {}
        self._bound: set[str] = set()
        """Every name that code of the document gives to something."""
        self._changed_elsewhere: set[str] = set()
        """Variables that functions within functions, and all code by `global`, assign."""
        self._assigned: set[str] = set()
        """Attributes that are assigned, or stand among the functions."""
        self._users: dict[str, set[int]] = {}
        """The automata whose code has an attribute, 0 for functions."""
        self._overloads = False
        """Whether operators may be functions of the document."""
        self._any_attribute = has_extension
        """Whether attributes of the component may be assigned where nobody sees it."""
        self._known: dict[str, _Found] = {}
        for library in document.libraries:
            if library.is_module and not library.name.is_blank:
                try:
                    self._import(parse_python(analyze_library(library.name)[0]))
                except CodeError:  # told when the component is generated
                    continue
        texts = [functions.text for functions in document.functions]
        for text in (*texts, *(automaton.functions for automaton in document.automata)):
            self._read_functions(text.text)
        for automaton in document.automata:
            for source in _sources(automaton):
                self._read(parse_piece(source), automaton.id)

    def of_state(self, automaton: Automaton, outgoing: Iterable[Transition]) -> list[Answer]:
        """Return what the guards of the transitions out of a state answer, one for each, guarded or not."""
        found = [
            self._of(parse_piece(text.text), automaton.id)
            for item in outgoing
            for text in [item.trigger if item.type == "condition" else item.guard]
        ]
        is_changing = any(changes for _, changes in found)
        return [max(answer, Answer.UNKNOWN) if is_changing else answer for answer, _ in found]

    def _of(self, tree: ast.AST | None, automaton: int) -> _Found:
        if tree is None:
            return _UNKNOWN
        return _worst(self._node(node, automaton) for node in _nodes(tree))

    def _node(self, node: ast.AST, automaton: int) -> _Found:
        match node:
            case ast.Call():
                return self._call(node)
            case ast.Attribute(ctx=ast.Load()):
                return self._attribute(node, automaton)
            case ast.Name(id=name, ctx=context):
                # 0 is a function, whose variables are its own
                is_own = isinstance(context, ast.Load) or automaton == 0
                return _STEADY if is_own and name not in self._changed_elsewhere else _UNKNOWN
            case ast.Attribute() | ast.Subscript(ctx=ast.Store() | ast.Del()):
                return _UNKNOWN
            case ast.NamedExpr() | ast.Await():
                return Answer.OTHER, True
            case ast.Compare(ops=operators, comparators=compared):
                for operator, right in zip(operators, compared, strict=True):
                    if isinstance(operator, ast.In | ast.NotIn) and not _is_display(right):
                        return _UNKNOWN  # it may be a generator
        is_operator = isinstance(node, ast.Compare | ast.BinOp | ast.UnaryOp | ast.BoolOp | ast.Subscript)
        if not isinstance(node, _PLAIN) or (self._overloads and is_operator):
            return _UNKNOWN
        return _STEADY

    def _call(self, call: ast.Call) -> _Found:
        path = _dotted(call.func)
        name = path[-1] if path else getattr(call.func, "attr", "")
        if path[:1] == ["self"] and len(path) == 2 and name in self._functions:
            return self._function(name)
        if path[:1] == ["self"] and len(path) > 2 and path[1] in self._proxies:
            return Answer.OTHER, False
        if path == ["self", "clock", "now"]:
            return Answer.UNKNOWN, False
        if name in self._bound:
            return _UNKNOWN
        full = ".".join([self._libraries.get(path[0], path[0]), *path[1:]]) if path else ""
        if full.startswith(_DRAWING_LIBRARIES) or name in _DRAWING:
            return Answer.OTHER, False
        if name in _TAKING:
            return Answer.OTHER, True
        if self._overloads:
            return _UNKNOWN
        several = len(call.args) > 1 and not any(isinstance(each, ast.Starred) for each in call.args)
        is_pure = full in _PURE or (full in _PURE_OF_SEVERAL and several) or full.startswith("math.")
        is_method = isinstance(call.func, ast.Attribute) and name in _PURE_METHODS
        return _STEADY if is_pure or is_method else _UNKNOWN

    def _function(self, name: str) -> _Found:
        if name not in self._known:
            self._known[name] = _STEADY  # one that calls itself adds nothing
            self._known[name] = _worst(
                self._of(ast.Module(node.body, []), 0)
                if isinstance(node, ast.FunctionDef) and not node.decorator_list
                else _UNKNOWN
                for node in self._functions[name]
            )
        return self._known[name]

    def _attribute(self, node: ast.Attribute, automaton: int) -> _Found:
        path = _dotted(node)
        if path[:1] == ["event"] or (path and path[0] in self._libraries.keys() - self._bound):
            return _STEADY
        if path[:1] != ["self"] or (len(path) > 2 and path[1] not in self._proxies):
            return Answer.UNKNOWN, node.attr in self._bound
        name = path[1]
        if name in self._functions:
            return _UNKNOWN
        is_own = automaton != 0 and self._users.get(name) == {automaton}
        stays = not self._any_attribute and (is_own or name not in self._assigned)
        return _STEADY if stays else (Answer.UNKNOWN, False)

    def _import(self, tree: ast.Module) -> None:
        for node in tree.body:
            for alias in getattr(node, "names", ()):
                start = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
                name = alias.asname or alias.name.split(".")[0]
                self._libraries[name] = start + (alias.name if alias.asname or start else name)

    def _read_functions(self, source: str) -> None:
        tree = parse_piece(source)
        for node in tree.body if tree else ():
            if isinstance(node, _DEFINITIONS):
                self._functions.setdefault(node.name, []).append(node)
            else:
                names = (inner.id for inner in ast.walk(node) if isinstance(inner, ast.Name))
                self._assigned.update(names)
        self._read(tree, 0)

    def _read(self, tree: ast.Module | None, automaton: int) -> None:
        """Note what code defines, assigns and uses; no tree is code that is no Python."""
        self._any_attribute |= tree is None
        own = {id(node) for node in tree.body} if tree and automaton else set()
        for node in ast.walk(tree) if tree else ():
            match node:
                case ast.Global(names=names) | ast.Nonlocal(names=names):
                    if isinstance(node, ast.Global) or id(node) not in own:
                        self._changed_elsewhere.update(names)
                case ast.Attribute(attr=name, ctx=context):
                    self._users.setdefault(name, set()).add(automaton)
                    if not isinstance(context, ast.Load):
                        self._assigned.add(name)
                    self._any_attribute |= name in ("__dict__", "__setattr__", "setattr")
                case ast.Name(id=name, ctx=ast.Load()):
                    self._any_attribute |= name in ("setattr", "vars", "exec", "eval")
                case ast.Name(id=name) | ast.arg(arg=name):
                    self._bound.add(name)
                case ast.Import(names=names) | ast.ImportFrom(names=names):
                    self._import(ast.Module([node], []))
                case _ if isinstance(node, _DEFINITIONS):
                    self._bound.add(node.name)
                    is_special = node.name.startswith("__") and node.name not in _HARMLESS_SPECIAL
                    self._overloads |= is_special
                    self._any_attribute |= is_special and "attr" in node.name


def _sources(automaton: Automaton) -> Iterator[str]:
    yield automaton.variables.text
    for state in automaton.states:
        values = (argument.value for argument in state.arguments)
        yield from (text.text for text in (state.entry, state.code, state.exit, *values))
    for transition in automaton.transitions:
        yield from (transition.guard.text, transition.code.text)
        if transition.type == "condition":
            yield transition.trigger.text


def _nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes to look at: of a call what is called only as far as it is computed."""
    pending = [tree]
    while pending:
        node = pending.pop()
        yield node
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            pending += [node.func.value, *node.args, *node.keywords]
        elif isinstance(node, ast.Call):
            pending += [*node.args, *node.keywords]
        elif not (isinstance(node, ast.Attribute) and _dotted(node)):
            pending += ast.iter_child_nodes(node)


def _worst(found: Iterable[_Found]) -> _Found:
    answer, changes = _STEADY
    for one, one_changes in found:
        answer, changes = max(answer, one), changes or one_changes
    return answer, changes


def _is_display(node: ast.expr) -> bool:
    return isinstance(node, ast.Tuple | ast.List | ast.Set | ast.Dict | ast.Constant)


def _dotted(node: ast.expr) -> list[str]:
    """Return the names of `a.b.c`, or nothing for what does not begin with a name."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return [node.id, *parts[::-1]] if isinstance(node, ast.Name) else []
