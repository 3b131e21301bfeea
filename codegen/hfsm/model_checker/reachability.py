"""Which states can be entered and which transitions can fire, and where everything ends unfinished."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from .exploration import Budget, cone_of
from .fireability import Fireability
from .guards import satisfy
from .model import AutomatonModel, Model, StateModel, TransitionModel
from .transition_system import ACTIVE, Configuration, TransitionSystem

__all__ = [
    "Deadlock",
    "Reachability",
    "StateResult",
    "TransitionResult",
    "WhyNever",
    "find_deadlocks",
    "find_reachable",
]


class Reachability(StrEnum):
    """What is known of a state or a transition."""

    POSSIBLE = "possible"
    IMPOSSIBLE = "impossible"
    UNDECIDED = "undecided"


class WhyNever(StrEnum):
    """Why a transition never fires, or a state is never entered."""

    NONE = ""
    GRAPH = "graph"
    """No transitions lead there, whatever their triggers."""
    ORIGIN = "origin"
    """The state before it is never entered."""
    GUARD = "guard"
    """The guard is always false."""
    EVENT = "event"
    """Nothing sends the event."""
    CHILDREN = "children"
    """The automata below never finish."""
    EARLIER = "earlier"
    """Another transition always fires first."""
    ANCESTORS = "ancestors"
    """The states above are left before there is time for it, or no cycle comes in the time that there is."""


@dataclass(frozen=True, slots=True)
class StateResult:
    """What is known of a state, by the ids of the document."""

    automaton: int
    state: int
    reachability: Reachability
    why: WhyNever = WhyNever.NONE


@dataclass(frozen=True, slots=True)
class TransitionResult:
    """What is known of a transition; `earlier` are the ids of those that always fire before it."""

    automaton: int
    transition: int
    reachability: Reachability
    why: WhyNever = WhyNever.NONE
    earlier: tuple[int, ...] = ()


@dataclass(frozen=True)
class Reached:
    """What is possible in every automaton, and what is neither known to be nor known not to be."""

    states: tuple[frozenset[int], ...]
    transitions: tuple[frozenset[int], ...]
    unknown: frozenset[int]
    """The automata of which only what is here is known to be possible."""


def find_reachable(model: Model, fireability: Fireability, budget: Budget) -> Reached:
    """Find out what is possible in each automaton, together with those that it depends on."""
    states: list[set[int]] = [set() for _ in model.automata]
    transitions: list[set[int]] = [set() for _ in model.automata]
    unknown: set[int] = set()
    live = [index for index, possible in enumerate(fireability.states) if possible]

    def is_settled(index: int) -> bool:
        return (
            states[index] == fireability.states[index]
            and transitions[index] == fireability.transitions[index]
        )

    def visit(system: TransitionSystem, configuration: Configuration) -> bool:
        """Note the states of a configuration; return whether one is new."""
        is_new = False
        for automaton, (state, flags, _) in zip(system.cone, configuration, strict=True):
            if flags & ACTIVE and state not in states[automaton]:
                states[automaton].add(state)
                is_new = True
        return is_new

    def explore(index: int, budget: Budget) -> bool:
        """Search until all that may be possible is seen; return false when the budget ends before."""
        system = TransitionSystem(model, cone_of(model, [index], fireability), fireability)
        start, node, _ = system.start()
        visit(system, start)
        seen, waiting = {node}, deque([node])
        while waiting and not is_settled(index):
            node = waiting.popleft()
            if not budget.take(system):
                return False
            for choice, configuration, following, _ in system.successors(node):
                if choice.transition is not None:
                    transitions[system.cone[node.position]].add(choice.transition.index)
                is_new = visit(system, configuration)
                if following not in seen:
                    seen.add(following)
                    # where there is something new, there is likely more
                    (waiting.appendleft if is_new else waiting.append)(following)
        return True

    for done, index in enumerate(live):
        share = budget.share(budget.left // (len(live) - done))
        if not is_settled(index) and not explore(index, share):
            unknown.add(index)
        budget.give_back(share)
    return Reached(
        states=tuple(map(frozenset, states)),
        transitions=tuple(map(frozenset, transitions)),
        unknown=frozenset(unknown),
    )


def state_results(model: Model, fireability: Fireability, reached: Reached) -> list[StateResult]:
    """Return what is known of every state."""
    results = []
    for automaton in model.automata:
        by_graph = _by_graph(automaton)
        for state in automaton.states:
            why = WhyNever.NONE
            if state.index in reached.states[automaton.index]:
                verdict = Reachability.POSSIBLE
            elif automaton.index in reached.unknown and state.index in fireability.states[automaton.index]:
                verdict = Reachability.UNDECIDED
            else:
                verdict = Reachability.IMPOSSIBLE
                why = _why_state(automaton, state, by_graph, reached)
            results.append(StateResult(automaton.source.id, state.source.id, verdict, why))
    return results


def transition_results(model: Model, fireability: Fireability, reached: Reached) -> list[TransitionResult]:
    """Return what is known of every transition."""
    results = []
    for automaton in model.automata:
        for state in automaton.states:
            for place, transition in enumerate(state.outgoing):
                verdict, why = Reachability.POSSIBLE, WhyNever.NONE
                earlier: tuple[int, ...] = ()
                if transition.index not in reached.transitions[automaton.index]:
                    possibly = fireability.may_fire(automaton.index, transition)
                    if possibly and automaton.index in reached.unknown:
                        verdict = Reachability.UNDECIDED
                    else:
                        verdict = Reachability.IMPOSSIBLE
                        why, earlier = _why_transition(automaton, state, place, fireability, reached)
                results.append(
                    TransitionResult(automaton.source.id, transition.source.id, verdict, why, earlier)
                )
    return results


def _by_graph(automaton: AutomatonModel) -> set[int]:
    found = {automaton.initial}
    new = [automaton.initial]
    while new:
        for transition in automaton.states[new.pop()].outgoing:
            if transition.target not in found:
                found.add(transition.target)
                new.append(transition.target)
    return found


def _why_state(
    automaton: AutomatonModel, state: StateModel, by_graph: set[int], reached: Reached
) -> WhyNever:
    if not reached.states[automaton.index]:
        return WhyNever.ORIGIN
    if state.index not in by_graph:
        return WhyNever.GRAPH
    into = [transition for transition in automaton.transitions if transition.target == state.index]
    if any(transition.origin in reached.states[automaton.index] for transition in into):
        return WhyNever.EARLIER
    return WhyNever.ORIGIN


def _why_transition(
    automaton: AutomatonModel, state: StateModel, place: int, fireability: Fireability, reached: Reached
) -> tuple[WhyNever, tuple[int, ...]]:
    transition = state.outgoing[place]
    if state.final or state.index not in reached.states[automaton.index]:
        return WhyNever.ORIGIN, ()
    if transition.needs is None:
        return WhyNever.GUARD, ()
    if transition.event and transition.event not in fireability.events:
        return WhyNever.EVENT, ()
    if transition.finished and not (state.children and fireability.finishing.issuperset(state.children)):
        return WhyNever.CHILDREN, ()
    if fireability.may_fire(automaton.index, transition):
        return WhyNever.ANCESTORS, ()
    return WhyNever.EARLIER, _always_earlier(automaton, state, transition, fireability)


def _always_earlier(
    automaton: AutomatonModel, state: StateModel, transition: TransitionModel, fireability: Fireability
) -> tuple[int, ...]:
    """Return the ids of those that keep a transition from firing: alone if one is enough, else all."""
    others = [
        other
        for other in state.outgoing
        if other is not transition
        and other.needs is not None
        and fireability.may_fire(automaton.index, other)
        and (other.delay < transition.delay or state.outgoing.index(other) < state.outgoing.index(transition))
    ]
    alone = [
        other
        for other in others
        if not other.finished and satisfy(transition.needs or (), [other.needs or ()]) is None
    ]
    return tuple(other.source.id for other in (alone[:1] or others))


@dataclass(frozen=True, slots=True)
class Deadlock:
    """A state of the root that nothing leaves, by its id, with states below in which nothing changes either.

    `paths` are the paths of the states that are current then.
    """

    state: int
    paths: tuple[str, ...]


def find_deadlocks(model: Model, reached: Reached) -> list[Deadlock]:
    """Return the states of the root in which everything may come to rest, none if it has a final state.

    Automata that have final states of their own are meant to end.
    """
    if not model.automata or 0 in reached.unknown:
        return []
    root = model.automata[0]
    if any(state.final for state in root.states) or len(root.states) < 2:
        return []
    found = []
    for state in root.states:
        if _is_stuck(state, root, reached):
            paths = _rest(model, root, state, reached)
            if paths is not None:
                found.append(Deadlock(state.source.id, tuple(paths)))
    return found


def _is_stuck(state: StateModel, automaton: AutomatonModel, reached: Reached) -> bool:
    """Return whether a state that can be entered holds its automaton for good."""
    leaves = any(each.index in reached.transitions[automaton.index] for each in state.outgoing)
    return state.index in reached.states[automaton.index] and not leaves and not state.final


def _rest(model: Model, automaton: AutomatonModel, state: StateModel, reached: Reached) -> list[str] | None:
    """Return where all below a state may come to rest, or None when something always goes on."""
    if not state.children:
        return [model.state_path(automaton.index, state.index)]
    paths: list[str] = []
    for child in state.children:
        below = next(_rests(model, model.automata[child], reached), None)
        if below is None:
            return None
        paths += below
    return paths


def _rests(model: Model, automaton: AutomatonModel, reached: Reached) -> Iterator[list[str]]:
    if automaton.index in reached.unknown:
        return
    for state in automaton.states:
        if state.final and state.index in reached.states[automaton.index]:
            yield [model.state_path(automaton.index, state.index)]
        elif _is_stuck(state, automaton, reached):
            paths = _rest(model, automaton, state, reached)
            if paths is not None:
                yield paths
