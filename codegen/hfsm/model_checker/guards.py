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
from enum import IntFlag
from typing import Final

from ..analysis import Analysis
from ..code.text import all_nodes, dotted
from ..code.values import truth
from ..document import Text

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


class Answer(IntFlag):
    """How a guard may answer when it is asked for the second time in one cycle.

    OTHER ones draw lots, read a sensor, or take something away. Asking a guard that CHANGES something may
    change what others answer.
    """

    SAME = 0
    UNKNOWN = 1
    OTHER = 2
    CHANGES = 4


_UNKNOWN: Final = Answer.UNKNOWN | Answer.CHANGES
_PURE: Final = frozenset({"abs", "bool", "float", "int", "isinstance", "len", "round", "str"})
_PURE_OF_SEVERAL: Final = frozenset({"max", "min"})
"""A single argument of theirs may be a generator."""
_PURE_METHODS: Final = frozenset({"endswith", "isalpha", "isdigit", "lower", "startswith", "strip", "upper"})
_DRAWING_LIBRARIES: Final = ("random.", "secrets.", "uuid.", "numpy.random.", "os.urandom")
_DRAWING: Final = frozenset({"choice", "gauss", "rand", "randint", "randn", "random", "randrange", "uniform"})
_TAKING: Final = frozenset({"next", "pop", "popleft", "read", "readline", "recv", "get_nowait", "shuffle"})
_ANY_NAME: Final = frozenset({"setattr", "vars", "exec", "eval", "__dict__", "__setattr__"})
"""What assigns where nobody sees it."""
_OPERATORS: Final = (ast.Compare, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Subscript)
_DISPLAYS: Final = (ast.Tuple, ast.List, ast.Set, ast.Dict, ast.Constant)
_PLAIN: Final = (
    *(ast.expr_context, ast.boolop, ast.operator, ast.unaryop, ast.cmpop, ast.keyword, ast.Starred),
    *(ast.Module, ast.IfExp, *_OPERATORS, *_DISPLAYS, ast.JoinedStr, ast.FormattedValue, ast.Slice),
    *(ast.Return, ast.Expr, ast.If, ast.Pass, ast.Assign, ast.AnnAssign, ast.Raise, ast.Assert),
)


class Answers:
    """What the guards of a document answer.

    Only constants stay for sure where classes of the document may define operators, or where `eval`, its
    like or hand-written code beside the document may assign anything.
    """

    def __init__(self, analysis: Analysis) -> None:
        self._analysis = analysis
        self._proxies = {interface.name for interface in analysis.document.interfaces}
        self._functions: dict[str, list[ast.FunctionDef]] = {}
        self._bound: set[str] = set()
        """Every name that code of the document gives to something."""
        self._shared: set[str] = set()
        """Variables that code assigns from within functions, or for the whole file."""
        self._assigned = set(analysis.defined)
        """Attributes of the component that are assigned."""
        self._users: dict[str, set[int]] = {}
        """The automata whose code has an attribute, 0 for functions."""
        self._is_opaque = analysis.extension is not None or not analysis.is_complete
        self._followed: set[str] = set()
        """The functions that the guard which is looked at calls."""
        for piece in analysis.functions:
            for node in piece.tree.body:
                if isinstance(node, ast.FunctionDef):
                    self._functions.setdefault(node.name, []).append(node)
            self._read(piece.tree, 0)
        for code in analysis.automata:
            for piece in code.sharing():
                self._read(piece.tree, code.automaton.id)

    def _read(self, tree: ast.Module, automaton: int) -> None:
        """Note what code defines, assigns and uses."""
        for node in all_nodes(tree):
            match node:
                case ast.Global(names=names) | ast.Nonlocal(names=names):
                    self._shared.update(names)
                case ast.Attribute(attr=name, ctx=context):
                    self._users.setdefault(name, set()).add(automaton)
                    if not isinstance(context, ast.Load):
                        self._assigned.add(name)
                    self._is_opaque |= name in _ANY_NAME
                case ast.Name(id=name, ctx=ast.Load()):
                    self._is_opaque |= name in _ANY_NAME
                case ast.Name(id=name) | ast.arg(arg=name) | ast.FunctionDef(name=name):
                    self._bound.add(name)
                case ast.AsyncFunctionDef(name=name):
                    self._bound.add(name)
                case ast.alias(name=name, asname=alias):
                    self._bound.add(alias or name.split(".")[0])
                case ast.ClassDef():
                    self._is_opaque = True

    def of_state(self, automaton: int, guards: Iterable[Text]) -> list[Answer]:
        """Return what guards of the transitions out of a state answer, also blank ones."""
        found = [self._guard(guard, automaton) for guard in guards]
        is_changing = any(Answer.CHANGES in each for each in found)
        return [each | Answer.UNKNOWN if is_changing else each for each in found]

    def _guard(self, text: Text, automaton: int) -> Answer:
        piece = self._analysis.piece(text)
        if piece is None:
            return _UNKNOWN if self._analysis.is_broken(text) else Answer.SAME
        self._followed.clear()
        return self._of(piece.tree, automaton=automaton)

    def _of(self, *trees: ast.AST, automaton: int = 0) -> Answer:
        """Return what code answers; that of functions, whose variables are its own, has no automaton."""
        answer = Answer.SAME
        pending = [*trees]
        while pending:
            node = pending.pop()
            answer |= self._node(node, automaton)
            match node:  # of a call what is called only as far as it is computed
                case ast.Call(func=function):
                    pending += [function.value] if isinstance(function, ast.Attribute) else []
                    pending += [*node.args, *node.keywords]
                case ast.Attribute() if dotted(node):
                    pass
                case _:
                    pending += ast.iter_child_nodes(node)
        return answer

    def _node(self, node: ast.AST, automaton: int) -> Answer:
        match node:
            case ast.Call():
                return self._call(node)
            case ast.Attribute(ctx=ast.Load()):
                return self._attribute(node, automaton)
            case ast.Name(id=name, ctx=context):
                is_own = isinstance(context, ast.Load) or automaton == 0
                stays = is_own and name not in self._shared and not self._is_opaque
                return Answer.SAME if stays else _UNKNOWN
            case ast.Attribute() | ast.Subscript(ctx=ast.Store() | ast.Del()):
                return _UNKNOWN
            case ast.NamedExpr() | ast.Await():
                return Answer.OTHER | Answer.CHANGES
            case ast.Compare(ops=operators, comparators=compared):
                for operator, right in zip(operators, compared, strict=True):
                    if isinstance(operator, ast.In | ast.NotIn) and not isinstance(right, _DISPLAYS):
                        return _UNKNOWN  # it may be a generator
        is_plain = isinstance(node, _PLAIN) and not (self._is_opaque and isinstance(node, _OPERATORS))
        return Answer.SAME if is_plain else _UNKNOWN

    def _call(self, call: ast.Call) -> Answer:
        path = dotted(call.func)
        name = path[-1] if path else getattr(call.func, "attr", "")
        if path[:1] == ["self"] and len(path) == 2 and name in self._functions:
            return self._function(name)
        if path[:1] == ["self"] and len(path) > 2 and path[1] in self._proxies:
            return Answer.OTHER
        if path == ["self", "clock", "now"]:
            return Answer.UNKNOWN
        if name in self._bound:
            return _UNKNOWN
        is_library = bool(path) and path[0] not in self._bound
        full = ".".join([self._analysis.libraries.get(path[0], path[0]), *path[1:]]) if is_library else ""
        if full.startswith(_DRAWING_LIBRARIES) or name in _DRAWING:
            return Answer.OTHER
        if name in _TAKING:
            return Answer.OTHER | Answer.CHANGES
        several = len(call.args) > 1 and not any(isinstance(each, ast.Starred) for each in call.args)
        is_pure = full in _PURE or (full in _PURE_OF_SEVERAL and several) or full.startswith("math.")
        is_method = isinstance(call.func, ast.Attribute) and name in _PURE_METHODS
        return Answer.SAME if (is_pure or is_method) and not self._is_opaque else _UNKNOWN

    def _function(self, name: str) -> Answer:
        if name in self._followed:
            return Answer.SAME  # one that is called again adds nothing
        self._followed.add(name)
        answer = Answer.SAME
        for function in self._functions[name]:
            answer |= _UNKNOWN if function.decorator_list else self._of(*function.body)
        return answer

    def _attribute(self, node: ast.Attribute, automaton: int) -> Answer:
        path = dotted(node)
        if path[:1] == ["event"] or (path and path[0] in self._analysis.libraries.keys() - self._bound):
            return Answer.SAME
        if path[:1] != ["self"] or (len(path) > 2 and path[1] not in self._proxies):
            return _UNKNOWN if node.attr in self._bound else Answer.UNKNOWN
        name = path[1]
        if name in self._functions:
            return _UNKNOWN
        is_own = automaton != 0 and self._users.get(name) == {automaton}
        stays = not self._is_opaque and (is_own or name not in self._assigned)
        return Answer.SAME if stays else Answer.UNKNOWN
