"""The logic of guards and properties, which the model checker and a running component share.

A component reads it at run time, so that this module needs nothing of the compiler.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final, TypeVar

Conjunction = tuple[tuple[str, bool], ...]
"""Atoms with their required values; the empty conjunction always holds."""

Form = tuple[Any, ...]
"""An expression of a property: `("true",)`, `("in", (automaton, state), ...)`, `("active", automaton)`,
`("finished", automaton)`, or `("not", form)`, `("and", form, ...)`, `("or", form, ...)`."""

PROOFS: Final = "_hfsm_proofs"
"""The attribute of a component that has what proofs about its document rely on."""

START: Final = '\nif __name__ == "__main__":'
"""What follows the class of a component."""

_MOST_STEPS: Final = 300
"""The limit of steps in the search for values of guards that depend on each other."""

_Where = TypeVar("_Where")


def read_proofs(component: str) -> tuple[Any, ...]:
    """Return what proofs rely on from the text of a component, whose class ends with it; () if nothing."""
    before, _, _ = component.rpartition(START)
    if not before.endswith("\n    )\n\n"):
        return ()
    rows: tuple[Any, ...] = ast.literal_eval(before.rpartition(f"\n    {PROOFS} = ")[2])
    return rows


def predicate(form: Form, leaf: Callable[[Form], Callable[[_Where], bool]]) -> Callable[[_Where], bool]:
    """Return the function of an expression; `leaf` returns those of its smallest parts."""
    kind, *parts = form
    match kind:
        case "not":
            negated = predicate(parts[0], leaf)
            return lambda where: not negated(where)
        case "and" | "or":
            combine, several = (all if kind == "and" else any), [predicate(each, leaf) for each in parts]
            return lambda where: combine(each(where) for each in several)
        case "true":
            return lambda _: True
    return leaf(form)


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
