"""Automata that run side by side and command the same servant: the robot obeys the one that came last."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

from .actuators import Command, Commands
from .cones import cone_of
from .counterexample import Counterexample, counterexample
from .exploration import Budget
from .expressions import Holds
from .fireability import Fireability
from .model import AutomatonModel, Model
from .reachability import Reached
from .search import search
from .transition_system import ACTIVE, FINISHED

__all__ = ["Conflict", "Use", "find_conflicts", "uses_of"]


@dataclass(frozen=True, slots=True)
class Use:
    """That an automaton commands a servant while it is in a state.

    `piece` says in which code: `code`, `entry`, `exit`, or `transition` with its id.
    """

    automaton: int
    state: int
    command: Command
    piece: str
    transition: int | None = None


@dataclass(frozen=True, slots=True)
class Conflict:
    """That two automata command one servant at the same time; their indices are those of the model.

    With `nested` the first is an ancestor of the second. `counterexample` leads to where both may do so. One
    that is not `certain` may be impossible: the search for a proof had to stop.
    """

    first: Use
    second: Use
    nested: bool
    certain: bool = True
    counterexample: Counterexample | None = None


def uses_of(model: Model, commands: Commands) -> list[list[Use]]:
    """Return what each automaton commands, state by state."""
    return [list(_uses(automaton, commands)) for automaton in model.automata]


def _uses(automaton: AutomatonModel, commands: Commands) -> Iterator[Use]:
    aliases = commands.aliases(automaton.source.variables)
    for state in automaton.states:
        source = state.source
        for piece, text in (("code", source.code), ("entry", source.entry), ("exit", source.exit)):
            if piece == "code" and source.final:
                continue
            for command in sorted(commands.of(text, aliases), key=repr):
                yield Use(automaton.index, state.index, command, piece)
        for transition in state.outgoing:
            for command in sorted(commands.of(transition.source.code, aliases), key=repr):
                yield Use(automaton.index, state.index, command, "transition", transition.index)


def find_conflicts(
    model: Model, uses: list[list[Use]], fireability: Fireability, reached: Reached, budget: Budget
) -> list[Conflict]:
    """Return the pairs of automata that command one servant side by side, each pair and servant once."""
    finder = _Finder(model, fireability, reached)
    by_servant: list[dict[str, list[Use]]] = []
    for of_one in uses:
        by_servant.append({})
        for use in of_one:
            if _is_possible(use, fireability):
                by_servant[-1].setdefault(use.command.identity, []).append(use)
    pairs = [
        (of_one[servant], of_other[servant])
        for of_one, of_other in combinations(by_servant, 2)
        for servant in sorted(of_one.keys() & of_other.keys())
    ]
    conflicts: list[Conflict] = []
    for done, (first, second) in enumerate(pairs):
        share = budget.share(budget.left // (len(pairs) - done))
        conflict = finder.conflict(first, second, share)
        budget.give_back(share)
        if conflict is not None:
            conflicts.append(conflict)
    return conflicts


def _is_possible(use: Use, fireability: Fireability) -> bool:
    if use.transition is not None and use.transition not in fireability.transitions[use.automaton]:
        return False
    return use.state in fireability.states[use.automaton]


class _Finder:
    def __init__(self, model: Model, fireability: Fireability, reached: Reached) -> None:
        self._model = model
        self._fireability = fireability
        self._reached = reached

    def conflict(self, first: list[Use], second: list[Use], budget: Budget) -> Conflict | None:
        """Return how two automata command one servant; `first` comes before in the model."""
        a, b = first[0].automaton, second[0].automaton
        owners = {above.index: owner.index for above, owner in self._model.ancestors(b)}
        if a in owners:
            return self._nested([use for use in first if use.state == owners[a]], second)
        for above, owner in self._model.ancestors(a):
            if above.index in owners:
                together = owners[above.index] == owner.index
                return self._side_by_side(first, second, budget) if together else None
        return None

    def _nested(self, above: list[Use], below: list[Use]) -> Conflict | None:
        # only the code of the state above runs again and again: its entry and exit have their own time
        above = [use for use in above if use.piece == "code"]
        index = below[0].automaton
        seen = [use for use in below if use.state in self._reached.states[index]]
        if not above or not (seen or index in self._reached.unknown):
            return None
        return Conflict(above[0], (seen or below)[0], nested=True, certain=bool(seen))

    def _side_by_side(self, first: list[Use], second: list[Use], budget: Budget) -> Conflict | None:
        cone = cone_of(self._model, [first[0].automaton, second[0].automaton], self._fireability)
        of_one, of_other = (_by_state(uses) for uses in (first, second))
        a, b = (uses[0].automaton for uses in (first, second))

        def both(positions: dict[int, int]) -> Holds:
            one, other = positions[a], positions[b]
            return lambda configuration: (
                configuration[one][1] & (ACTIVE | FINISHED) == ACTIVE
                and configuration[other][1] & (ACTIVE | FINISHED) == ACTIVE
                and configuration[one][0] in of_one
                and configuration[other][0] in of_other
            )

        goals = [(a, min(of_one)), (b, min(of_other))]
        searched = search(
            self._model, cone, self._fireability, both, budget=budget, goals=goals, lasting=True
        )
        run, system = searched.outcome.run, searched.system
        if run is None:
            certain = searched.outcome.complete
            return None if certain else Conflict(first[0], second[0], nested=False, certain=False)
        one, other = system.position[a], system.position[b]
        last = run.moves[-1].configuration if run.moves else run.start
        return Conflict(
            of_one[last[one][0]],
            of_other[last[other][0]],
            nested=False,
            counterexample=counterexample(self._model, system, run),
        )


def _by_state(uses: list[Use]) -> dict[int, Use]:
    found: dict[int, Use] = {}
    for use in uses:
        found.setdefault(use.state, use)
    return found
