"""Where everything ends without having finished: no automaton can ever change its state again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from .fireability import Fireability
from .model import Model

__all__ = ["Deadlock", "find_deadlocks"]


@dataclass(frozen=True, slots=True)
class Deadlock:
    """A state of the root that nothing leaves, by its id, with states below in which nothing changes either.

    `paths` are the paths of the states that are current then.
    """

    state: int
    paths: tuple[str, ...]


def find_deadlocks(model: Model, fireability: Fireability) -> list[Deadlock]:
    """Return the states of the root in which everything may come to rest, none if it has a final state.

    Automata that have final states of their own are meant to end.
    """
    if not model.automata or 0 not in fireability.exact:
        return []
    root = model.automata[0]
    if any(state.final for state in root.states) or len(root.states) < 2:
        return []
    found = []
    for state in sorted(fireability.stuck[0]):
        paths = _rest(model, 0, state, fireability)
        if paths is not None:
            found.append(Deadlock(root.states[state].source.id, tuple(paths)))
    return found


def _rest(model: Model, automaton: int, state: int, fireability: Fireability) -> list[str] | None:
    """Return where all below a state may come to rest, or None when something always goes on."""
    children = model.automata[automaton].states[state].children
    if not children:
        return [model.state_path(automaton, state)]
    paths: list[str] = []
    for child in children:
        below = next(_rests(model, child, fireability), None)
        if below is None:
            return None
        paths += below
    return paths


def _rests(model: Model, automaton: int, fireability: Fireability) -> Iterator[list[str]]:
    if automaton not in fireability.exact:
        return
    for state in model.automata[automaton].states:
        if state.index not in fireability.states[automaton]:
            continue
        if state.final:
            yield [model.state_path(automaton, state.index)]
        elif state.index in fireability.stuck[automaton]:
            paths = _rest(model, automaton, state.index, fireability)
            if paths is not None:
                yield paths
