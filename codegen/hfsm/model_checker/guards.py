"""Guards as the model checker sees them: atoms that may be true or false in each cycle.

Two guards of one automaton with the same text have the same value within one cycle, and `not x` has the other
value than `x`. A conjunction is a set of literals; whatever else a guard consists of is one atom.
"""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from ..checks import truth
from ..code.trees import parse_python

__all__ = ["Assignment", "Conjunction", "conjunction", "satisfy"]

Conjunction = tuple[tuple[str, bool], ...]
"""Atoms with the values that they need; the empty one always holds."""

Assignment = Mapping[str, bool]
"""Values of atoms; those that are missing are false."""

_MOST_STEPS: Final = 20_000
"""Steps of the search for values of guards that depend on one another; it may take 2 to the power of them."""


def conjunction(text: str, unique: str, *, is_steady: bool = True) -> Conjunction | None:
    """Return what a guard, a Python expression or a body that returns one, needs; None if it never holds.

    `unique` names the atom of a guard that is not steady: its value may change each time it is asked.
    """
    source = textwrap.dedent(text).strip()
    try:
        tree: ast.expr | None = parse_python(source, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        tree = None
    value = None if tree is None else truth(tree)
    if value is not None:
        return () if value else None
    if tree is None or not is_steady:
        return ((source if is_steady else unique, True),)
    literals: dict[str, bool] = {}
    try:
        for atom, value in _literals(tree, True):
            if literals.setdefault(atom, value) is not value:
                return None
    except _NeverHolds:
        return None
    except RecursionError:
        return ((source, True),)
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
    entangled: list[Conjunction] = []
    for clause in refused:
        if len(clause) != 1:
            entangled.append(clause)
        elif values.setdefault(clause[0][0], not clause[0][1]) is clause[0][1]:
            return None
    clauses = _without_alternative(values, entangled)
    if clauses is None or not all(_refuse(values, group) for group in _groups(clauses)):
        return None
    return values


def _without_alternative(values: dict[str, bool], clauses: list[Conjunction]) -> list[Conjunction] | None:
    """Set the atoms that leave no choice; return the clauses that do, or None when one cannot be false."""
    while True:
        left: list[Conjunction] = []
        known = len(values)
        for clause in clauses:
            if any(values.get(atom, value) is not value for atom, value in clause):
                continue
            undecided = tuple(literal for literal in clause if literal[0] not in values)
            if not undecided:
                return None
            if len(undecided) == 1:
                ((atom, value),) = undecided
                values[atom] = not value
            else:
                left.append(undecided)
        if len(values) == known:
            return left
        clauses = left


def _groups(clauses: Sequence[Conjunction]) -> Iterator[list[Conjunction]]:
    """Yield the clauses in groups that have no atoms in common, so that each can be looked at alone."""
    having: dict[str, list[int]] = {}
    for index, clause in enumerate(clauses):
        for atom, _ in clause:
            having.setdefault(atom, []).append(index)
    seen: set[int] = set()
    for start in range(len(clauses)):
        pending, group = [start], []
        while pending:
            index = pending.pop()
            if index not in seen:
                seen.add(index)
                group.append(clauses[index])
                pending += [other for atom, _ in clauses[index] for other in having.pop(atom, ())]
        if group:
            yield group


def _refuse(values: dict[str, bool], clauses: Sequence[Conjunction]) -> bool:
    """Extend `values` until every clause is false, by trying its literals one after the other."""
    trail: list[tuple[int, int, str | None]] = []  # clause, literal that is false in it, atom set for it
    clause, first = 0, 0
    for _ in range(_MOST_STEPS):
        if clause == len(clauses):
            return True
        for index in range(first, len(clauses[clause])):
            atom, value = clauses[clause][index]
            if atom not in values:
                values[atom] = not value
                trail.append((clause, index, atom))
                break
            if values[atom] is not value:
                trail.append((clause, index, None))
                break
        else:
            while trail and trail[-1][2] is None:  # it was false anyway: another literal is no way out
                trail.pop()
            if not trail:
                return False
            clause, first, undone = trail.pop()
            assert undone is not None
            del values[undone]
            first += 1
            continue
        clause, first = clause + 1, 0
    return True
