"""Search for a configuration, in the way that suits the automata: exact, without time, or straight to it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

from .exploration import Budget, Move, Outcome, Run, find
from .expressions import Holds
from .fireability import Fireability
from .guards import satisfy
from .model import Model, StateModel
from .transition_system import ACTIVE, Configuration, TransitionSystem

__all__ = ["Goal", "Searched", "search", "system_of"]

Goal = tuple[int, int]
"""An automaton and the state that a configuration should have it in, -1 for any."""


@dataclass(frozen=True, slots=True)
class Searched:
    """What a search came to, and the exact system that the run belongs to."""

    system: TransitionSystem
    outcome: Outcome


def search(
    model: Model,
    cone: Collection[int],
    fireability: Fireability,
    holds: Callable[[dict[int, int]], Holds],
    *,
    budget: Budget,
    within: int | None = None,
    goals: Collection[Goal] = (),
    lasting: bool = False,
) -> Searched:
    """Search a configuration of the automata in a cone, in the first `within` ns.

    `holds` takes the positions of the automata. `goals` are where it is likely to be found. A `lasting` one
    is not over at the moment at which it comes. The run is the earliest there is, unless that takes more than
    half of the budget.
    """
    exact = TransitionSystem(model, cone, fireability)
    wanted = holds(exact.position)
    if within is not None:
        return Searched(exact, find(exact, wanted, within, budget, lasting=lasting))
    system = system_of(model, cone, fireability)
    first = budget.share(budget.left // 2 if goals else budget.left)
    outcome = find(system, wanted, None, first, lasting=lasting)
    budget.give_back(first)
    if not outcome.complete and goals:
        explored = outcome.explored
        outcome = find(system, wanted, None, budget, _distance(model, system, goals), lasting=lasting)
        outcome.explored += explored
    if outcome.run is not None and system.uniform:
        run = _retimed(exact, outcome.run)
        outcome = Outcome(run, run is not None, outcome.explored, 0 if run is None else run.ends)
    return Searched(exact, outcome)


def system_of(model: Model, cone: Collection[int], fireability: Fireability) -> TransitionSystem:
    """Return the simplest system in which the same configurations are reachable.

    Where nothing depends on time, and nothing has to happen at any time, all periods may as well be the same.
    """
    timeless = all(
        _is_timeless(model.automata[index].states[state], fireability, index, model.automata[index].initial)
        for index in cone
        for state in fireability.states[index]
    )
    return TransitionSystem(model, cone, fireability, uniform=timeless)


def _is_timeless(state: StateModel, fireability: Fireability, automaton: int, initial: int) -> bool:
    outgoing = [transition for transition in state.outgoing if fireability.may_fire(automaton, transition)]
    if any(transition.delay for transition in outgoing) or (state.owes and state.children):
        return False
    if state.final:
        return state.index != initial
    return satisfy((), (transition.needs or () for transition in outgoing)) is not None


def _retimed(exact: TransitionSystem, run: Run) -> Run | None:
    """Return a run of the exact system in which the same transitions fire one after the other."""
    start, node, time = exact.start()
    moves: list[Move] = []
    for wanted in run.moves:
        if wanted.choice.transition is None:
            continue
        for _ in range(10 * len(exact.cone) * max(exact.ratio, 1)):
            outcomes = list(exact.successors(node))
            at = node.position == wanted.node.position
            fitting = [one for one in outcomes if at and one[0].transition is wanted.choice.transition]
            fitting = fitting or [one for one in outcomes if one[0].transition is None]
            if not fitting:
                return None
            choice, configuration, following, elapsed = fitting[0]
            moves.append(Move(time, node, choice, configuration))
            node, time = following, time + elapsed
            if choice.transition is not None:
                break
        else:
            return None
    return Run(start, tuple(moves), moves[-1].time if moves else 0)


def _distance(
    model: Model, system: TransitionSystem, goals: Collection[Goal]
) -> Callable[[Configuration], int]:
    """Return how far a configuration is from the goals, in transitions and levels."""
    steps: list[list[tuple[int, dict[int, int]]]] = []
    for automaton, state in goals:
        chain = [(above.index, owner.index) for above, owner in model.ancestors(automaton)][::-1]
        chain += [(automaton, state)] if state >= 0 else []
        steps.append([(system.position[index], _hops(model, index, target)) for index, target in chain])
    far = 1000

    def distance(configuration: Configuration) -> int:
        total = 0
        for chain in steps:
            for level, (position, hops) in enumerate(chain):
                state, flags, _ = configuration[position]
                left = hops.get(state, far // 2) if flags & ACTIVE else far // 2
                if left:
                    total += left + far * (len(chain) - level)
                    break
        return total

    return distance


def _hops(model: Model, automaton: int, target: int) -> dict[int, int]:
    """Return how many transitions it is from each state to one."""
    into: dict[int, set[int]] = {}
    for transition in model.automata[automaton].transitions:
        into.setdefault(transition.target, set()).add(transition.origin)
    hops = {target: 0}
    new = [target]
    for state in new:  # grows
        for origin in into.get(state, ()):
            if origin not in hops:
                hops[origin] = hops[state] + 1
                new.append(origin)
    return hops
