"""Guards as the model checker sees them: atoms that may be true or false in each cycle.

Two guards of one automaton with the same text have the same value within one cycle, and `not x` has the other
value than `x`. A conjunction is a set of literals; whatever else a guard consists of is one atom.
"""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

__all__ = ["Assignment", "Conjunction", "conjunction", "satisfy"]

Conjunction = tuple[tuple[str, bool], ...]
"""Atoms with the values that they need; the empty one always holds."""

Assignment = Mapping[str, bool]
"""Values of atoms; those that are missing are false."""

_CHANGES_WHEN_ASKED: Final = re.compile(r"random|shuffle|choice|next|pop|read|recv|get_nowait|:=|\bawait\b")
"""What makes the second value of an expression in one cycle independent of the first."""


def conjunction(text: str, unique: str) -> Conjunction | None:
    """Return what a guard, a Python expression or a body that returns one, needs; None if it never holds.

    `unique` names the atom of a guard that may change its value each time it is asked.
    """
    source = textwrap.dedent(text).strip()
    try:
        tree: ast.expr | None = ast.parse(source, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        tree = None
    if tree is None or _CHANGES_WHEN_ASKED.search(source):
        return ((unique if tree is not None else source, True),)
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
        try:
            constant = bool(ast.literal_eval(tree))
        except (ValueError, TypeError, SyntaxError, MemoryError):
            yield ast.unparse(tree), wanted
        else:
            if constant is not wanted:
                raise _NeverHolds


def satisfy(wanted: Conjunction, refused: Iterable[Conjunction]) -> dict[str, bool] | None:
    """Return values of atoms for which `wanted` holds and none of `refused` does, or None.

    Atoms of no importance are left out.
    """
    values: dict[str, bool] = {}
    for atom, value in wanted:
        if values.setdefault(atom, value) is not value:
            return None
    open_clauses: list[Conjunction] = []
    for clause in refused:
        if len(clause) == 1:  # a clause of one literal leaves no choice
            atom, value = clause[0]
            if values.setdefault(atom, not value) is value:
                return None
        else:
            open_clauses.append(clause)
    return _refuse(values, open_clauses)


def _refuse(values: dict[str, bool], clauses: Sequence[Conjunction]) -> dict[str, bool] | None:
    """Extend `values` until every clause is false, by trying its literals one after the other."""
    trail: list[tuple[int, int, str | None]] = []  # clause, literal that is false in it, atom set for it
    clause, first = 0, 0
    while clause < len(clauses):
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
                return None
            clause, first, undone = trail.pop()
            assert undone is not None
            del values[undone]
            first += 1
            continue
        clause, first = clause + 1, 0
    return values
