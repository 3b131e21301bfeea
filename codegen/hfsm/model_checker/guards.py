"""Guards as the model checker sees them: atoms that may be true or false in each cycle.

Two guards of one automaton with the same text have the same value within one cycle, and `not x` has the other
value than `x`. A conjunction is a set of literals; whatever else a guard consists of is one atom.

Guards whose value may change within a cycle are told from those that stay: functions of the document are
followed. Of what cannot be followed nothing is known: functions of libraries, methods and attributes of
objects, attributes of the component that others assign.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from enum import IntEnum
from typing import Final

from ..analysis import Analysis, imported_names
from ..code.text import all_nodes
from ..code.values import truth
from ..document import Automaton, Text, Transition

__all__ = ["Answer", "Answers", "Conjunction", "conjunction", "satisfy"]

Conjunction = tuple[tuple[str, bool], ...]
"""Atoms with the values that they need; the empty one always holds."""

Assignment = Mapping[str, bool]
"""Values of atoms; those that are missing are false."""

_MOST_STEPS: Final = 300
"""Steps of the search for values of guards that depend on one another."""


def conjunction(
    tree: ast.expr | None, text: str, unique: str, *, is_steady: bool = True
) -> Conjunction | None:
    """Return what a guard needs: an expression, or None for a body that returns one; None if it never holds.

    `text` is the guard as it is written. `unique` names the atom of a guard that is not steady: its value may
    change each time it is asked.
    """
    value = None if tree is None else truth(tree)
    if value is not None:
        return () if value else None
    if tree is None or not is_steady:
        return ((text if is_steady else unique, True),)
    literals: dict[str, bool] = {}
    try:
        for atom, value in _literals(tree, True):
            if literals.setdefault(atom, value) is not value:
                return None
    except _NeverHolds:
        return None
    except RecursionError:
        return ((text, True),)
    return tuple(literals.items())


class _NeverHolds(Exception):
    """A part of a conjunction is false whatever the rest is."""


def _literals(tree: ast.expr, wanted: bool) -> Iterator[tuple[str, bool]]:
    if isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.Not):
        yield from _literals(tree.operand, not wanted)
    elif isinstance(tree, ast.BoolOp) and isinstance(tree.op, ast.And) is wanted:
        for operand in tree.values:
            yield from _literals(operand, wanted)
    else:
        constant = truth(tree)
        if constant is None:
            yield ast.unparse(tree), wanted
        elif constant is not wanted:
            raise _NeverHolds


def satisfy(wanted: Conjunction, refused: Iterable[Conjunction]) -> dict[str, bool] | None:
    """Return values of atoms for which `wanted` holds and none of `refused` does, or None.

    Atoms of no importance are left out. Where guards are so entangled that a search takes too long, it is
    given up, and what it was at is returned: then the guards count as possible.
    """
    values: dict[str, bool] = {}
    for atom, value in wanted:
        if values.setdefault(atom, value) is not value:
            return None
    return _refuse(values, list(refused), iter(range(_MOST_STEPS)))


def _refuse(
    values: dict[str, bool], clauses: list[Conjunction], steps: Iterator[int]
) -> dict[str, bool] | None:
    """Extend `values` until every clause is false (the algorithm of Davis, Putnam, Logemann and Loveland)."""
    literals = {literal for clause in clauses for literal in clause}
    while True:
        undecided: list[Conjunction] = []
        known = len(values)
        for clause in clauses:
            if any(values.get(atom, value) is not value for atom, value in clause):
                continue
            free = [(atom, value) for atom, value in clause if atom not in values]
            if not free:
                return None
            for atom, value in free:  # set what leaves no choice, or harms no other clause
                if len(free) == 1 or (atom, not value) not in literals:
                    values[atom] = not value
                    break
            else:
                undecided.append(clause)
        if not undecided or next(steps, None) is None:
            return values
        if len(values) == known:
            break
        clauses = undecided
    atom, value = next(literal for literal in undecided[0] if literal[0] not in values)
    for choice in (not value, value):
        found = _refuse({**values, atom: choice}, undecided, steps)
        if found is not None:
            return found
    return None


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

    def __init__(self, analysis: Analysis) -> None:
        self._analysis = analysis
        self._proxies = {interface.name for interface in analysis.document.interfaces}
        self._functions: dict[str, list[ast.stmt]] = {}
        self._libraries = dict(analysis.libraries)
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
        self._any_attribute = analysis.extension is not None or not analysis.is_complete
        """Whether attributes of the component may be assigned where nobody sees it."""
        self._known: dict[str, _Found] = {}
        for piece in analysis.functions:
            self._read_functions(piece.tree)
        for code in analysis.automata:
            for piece in code.sharing():
                self._read(piece.tree, code.automaton.id)

    def of_state(self, automaton: Automaton, outgoing: Iterable[Transition]) -> list[Answer]:
        """Return what the guards of the transitions out of a state answer, one for each, guarded or not."""
        found = [
            self._guard(item.trigger if item.type == "condition" else item.guard, automaton.id)
            for item in outgoing
        ]
        is_changing = any(changes for _, changes in found)
        return [max(answer, Answer.UNKNOWN) if is_changing else answer for answer, _ in found]

    def _guard(self, text: Text, automaton: int) -> _Found:
        piece = self._analysis.piece(text)
        if piece is None:
            return _UNKNOWN if self._analysis.is_broken(text) else _STEADY
        return self._of(piece.tree, automaton)

    def _of(self, tree: ast.AST, automaton: int) -> _Found:
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

    def _read_functions(self, tree: ast.Module) -> None:
        for node in tree.body:
            if isinstance(node, _DEFINITIONS):
                self._functions.setdefault(node.name, []).append(node)
            else:
                names = (inner.id for inner in ast.walk(node) if isinstance(inner, ast.Name))
                self._assigned.update(names)
        self._read(tree, 0)

    def _read(self, tree: ast.Module, automaton: int) -> None:
        """Note what code defines, assigns and uses."""
        own = {id(node) for node in tree.body} if automaton else set()
        for node in all_nodes(tree):
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
                case ast.Import() | ast.ImportFrom():
                    self._libraries.update(imported_names(node))
                case _ if isinstance(node, _DEFINITIONS):
                    self._bound.add(node.name)
                    is_special = node.name.startswith("__") and node.name not in _HARMLESS_SPECIAL
                    self._overloads |= is_special
                    self._any_attribute |= is_special and "attr" in node.name


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
