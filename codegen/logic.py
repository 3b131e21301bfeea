"""The logic of guards and properties, which the model checker and a running component share.

A component reads it at run time, so that this module needs nothing of the compiler.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final, NamedTuple, TypeVar

Conjunction = tuple[tuple[str, bool], ...]
"""Atoms with their required values; the empty conjunction always holds."""

Form = tuple[Any, ...]
"""An expression of a property: `("true",)`, `("in", (automaton, state), ...)`, `("active", automaton)`,
`("finished", automaton)`, or `("not", form)`, `("and", form, ...)`, `("or", form, ...)`."""


class Sent(NamedTuple):
    """An event that comes from code alone, in the cycles in these states of automata."""

    event: str
    states: tuple[tuple[int, int], ...]


class Guard(NamedTuple):
    """A guard out of a state is a conjunction; its atoms keep their values in a cycle."""

    automaton: int
    state: int
    transition: int
    needs: Conjunction


class Link(NamedTuple):
    """Atoms of guards out of a state never have these values."""

    automaton: int
    state: int
    values: Conjunction


class Unentered(NamedTuple):
    """A state that is never entered."""

    automaton: int
    state: int


class Unfired(NamedTuple):
    """A transition that never fires."""

    automaton: int
    transition: int


class Property(NamedTuple):
    """A property that holds, `within` ns if not 0; by the times of transitions, if it is timed."""

    name: str
    kind: str
    within: int
    is_timed: bool
    decided_by: tuple[int, ...]
    """Automata."""
    form: Form


Relied = Sent | Guard | Link | Unentered | Unfired | Property
"""One thing that proofs rely on; automata, states and transitions are their ids."""

Row = tuple[Any, ...]
"""The same as a component keeps it: its name, such as "sent", and what it holds."""

_KINDS: Final[dict[str, Callable[..., Relied]]] = {
    each.__name__.lower(): each for each in (Sent, Guard, Link, Unentered, Unfired, Property)
}

PROOFS: Final = "_hfsm_proofs"
"""The attribute of a component that has the rows."""

START: Final = '\nif __name__ == "__main__":'
"""What follows the class of a component."""

_MOST_STEPS: Final = 300
"""The limit of steps in the search for values of guards that depend on each other."""

_Where = TypeVar("_Where")


def to_row(relied: Relied) -> Row:
    """Return what a component keeps."""
    return type(relied).__name__.lower(), *relied


def from_row(row: Row) -> Relied:
    """Return what a component has kept."""
    kind, *parts = row
    return _KINDS[kind](*parts)


def read_proofs(component: str) -> tuple[Row, ...]:
    """Return what proofs rely on from the text of a component, whose class ends with it; () if nothing."""
    before, _, _ = component.rpartition(START)
    if not before.endswith("\n    )\n\n"):
        return ()
    rows: tuple[Row, ...] = ast.literal_eval(before.rpartition(f"\n    {PROOFS} = ")[2])
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
