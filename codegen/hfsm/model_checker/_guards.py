"""Read guards as conjunctions of atoms, each of which may be true or false in each cycle.

Two guards of one automaton with the same text have the same value within one cycle, and `not x` has the
opposite value of `x`. A conjunction is a set of literals; any other part of a guard is one atom.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from typing import Final

from ..code._values import truth

Conjunction = tuple[tuple[str, bool], ...]
"""Atoms with their required values; the empty conjunction always holds."""

_MOST_STEPS: Final = 300
"""The limit of steps in the search for values of guards that depend on each other."""


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


def satisfy(wanted: Conjunction, refused: Iterable[Conjunction]) -> dict[str, bool] | None:
    """Return values of atoms for which `wanted` holds and none of `refused` does, or None.

    Irrelevant atoms are left out. If the guards are too entangled for a complete search, the values found so
    far are returned: the guards then count as possible.
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
            for atom, value in free:  # unit clauses, and atoms that no other clause needs
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
