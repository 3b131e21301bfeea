"""Read guards as conjunctions of atoms, each of which may be true or false in each cycle.

Two guards of one automaton with the same text have the same value within one cycle, and `not x` has the
opposite value of `x`. A conjunction is a set of literals; any other part of a guard is one atom.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from ...logic import Conjunction
from ..code._values import truth


def conjunction(
    tree: ast.expr | None, text: str, unique: str, *, is_steady: bool = True
) -> Conjunction | None:
    """Return the conjunction of a guard, or None if it never holds.

    `tree` is None for a guard of statements, whose source is `text`. `unique` names the atom of a guard that
    is not steady: its value may change at each evaluation.
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
    """A part of a conjunction is always false."""


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
