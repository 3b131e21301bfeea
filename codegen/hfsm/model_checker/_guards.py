"""Read guards as conjunctions of atoms, each of which may be true or false in each cycle.

Two guards of one automaton with the same text have the same value within one cycle, and `not x` has the
opposite value of `x`. A conjunction is a set of literals; any other part of a guard is one atom, and a
definition says that it has its value exactly if all literals of a conjunction do.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final

from ...logic import Conjunction
from ..code._values import truth

NOT_TOTAL: Final[Mapping[ast.Compare, bool]] = MappingProxyType({})
Definition = tuple[tuple[str, bool], Conjunction]
"""The literal of an atom that consists of others, and what is true exactly if it is."""


def conjunction(
    tree: ast.expr | None,
    text: str,
    unique: str,
    *,
    is_steady: bool = True,
    total: Mapping[ast.Compare, bool] = NOT_TOTAL,
) -> Conjunction | None:
    """Return the conjunction of a guard, or None if it never holds.

    `tree` is None for a guard of statements, whose source is `text`. `unique` names the atom of a guard that
    is not steady: its value may change at each evaluation. `total` says of comparisons whether what they
    compare is in order, so that `<=` is true exactly if `>` is false.
    """
    value = None if tree is None else truth(tree)
    if value is not None:
        return () if value else None
    if tree is None or not is_steady:
        return ((text if is_steady else unique, True),)
    literals: dict[str, bool] = {}
    try:
        for part, value in _parts(tree, True, total):
            if literals.setdefault(ast.unparse(part), value) is not value:
                return None
    except _NeverHolds:
        return None
    except RecursionError:
        return ((text, True),)
    return tuple(literals.items())


def definitions(tree: ast.expr, total: Mapping[ast.Compare, bool] = NOT_TOTAL) -> Iterator[Definition]:
    """Yield the definitions of the atoms of a guard that consist of others, such as `a or b`."""
    try:
        for part, _ in _parts(tree, True, total):
            yield from _defined(part, total)
    except (_NeverHolds, RecursionError):
        return


def _defined(atom: ast.expr, total: Mapping[ast.Compare, bool]) -> Iterator[Definition]:
    """Yield those of an atom: `a and b` is true with all its parts, and `a or b` false without them."""
    if isinstance(atom, ast.BoolOp):
        value = isinstance(atom.op, ast.And)
        parts = [*_parts(atom, value, total)]
        yield (ast.unparse(atom), value), tuple((ast.unparse(part), wanted) for part, wanted in parts)
        for part, _ in parts:
            yield from _defined(part, total)


def never(definition: Definition) -> Iterator[Conjunction]:
    """Yield what is never true by a definition."""
    (atom, value), parts = definition
    yield (*parts, (atom, not value))
    for part, wanted in parts:
        yield (atom, value), (part, not wanted)


_OPPOSITES: Final[Mapping[type, type[ast.cmpop]]] = {
    ast.IsNot: ast.Is,
    ast.NotEq: ast.Eq,
    ast.NotIn: ast.In,
}
"""Comparisons that are true exactly if others are false."""
_OPPOSITES_IN_ORDER: Final[Mapping[type, type[ast.cmpop]]] = {ast.LtE: ast.Gt, ast.Lt: ast.GtE}
"""The same of what is in order; `<=` and `>` are both false of a nan, and of sets."""


class _NeverHolds(Exception):
    """A part of a conjunction is always false."""


def _parts(
    tree: ast.expr, wanted: bool, total: Mapping[ast.Compare, bool]
) -> Iterator[tuple[ast.expr, bool]]:
    if isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.Not):
        yield from _parts(tree.operand, not wanted, total)
    elif isinstance(tree, ast.BoolOp) and isinstance(tree.op, ast.And) is wanted:
        for operand in tree.values:
            yield from _parts(operand, wanted, total)
    elif (constant := truth(tree)) is not None:
        if constant is not wanted:
            raise _NeverHolds
    elif isinstance(tree, ast.Compare) and len(tree.ops) == 1 and type(tree.ops[0]) in _OPPOSITES:
        yield ast.Compare(tree.left, [_OPPOSITES[type(tree.ops[0])]()], tree.comparators), not wanted
    elif isinstance(tree, ast.Compare) and total.get(tree) and type(tree.ops[0]) in _OPPOSITES_IN_ORDER:
        opposite = _OPPOSITES_IN_ORDER[type(tree.ops[0])]()
        yield ast.Compare(tree.left, [opposite], tree.comparators), not wanted
    else:
        yield tree, wanted
