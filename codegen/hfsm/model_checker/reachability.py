"""Which states can be entered and which transitions can fire, and where everything ends unfinished."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from .exploration import Budget, cone_of, explore, system_of
from .fireability import Fireability
from .guards import satisfy
from .model import AutomatonModel, Model, StateModel, TransitionModel
from .transition_system import ACTIVE, Choice, Configuration

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
    """Find out what is possible in each automaton.

    Where the look at one automaton alone leaves doubt, the automata that it depends on are searched together.
    """
    finder = _Finder(model, fireability)
    unknown: set[int] = set()
    doubtful = [
        index for index, states in enumerate(fireability.states) if states and index not in fireability.exact
    ]
    for done, index in enumerate(doubtful):
        share = budget.share(budget.left // (len(doubtful) - done))
        if not finder.search(index, share):
            unknown.add(index)
        budget.give_back(share)
    return Reached(
        states=tuple(map(frozenset, finder.states)),
        transitions=tuple(map(frozenset, finder.transitions)),
        unknown=frozenset(unknown),
    )


class _Finder:
    """What was found to be possible so far, in each automaton."""

    def __init__(self, model: Model, fireability: Fireability) -> None:
        self._model = model
        self._fireability = fireability
        self.states = [set(found) for found in fireability.certain_states]
        self.transitions = [set(found) for found in fireability.certain_transitions]

    def search(self, index: int, budget: Budget) -> bool:
        """Search until all that may be possible is seen; false when the budget ends before."""
        cone = cone_of(self._model, [index], self._fireability)
        system = system_of(self._model, cone, self._fireability)
        states, transitions = self.states, self.transitions
        wanted = len(self._fireability.states[index]) + len(self._fireability.transitions[index])

        def visit(configuration: Configuration, position: int, choice: Choice | None) -> bool:
            for automaton, (state, flags, _) in zip(system.cone, configuration, strict=True):
                if flags & ACTIVE:
                    states[automaton].add(state)
            if choice is not None and choice.transition is not None:
                transitions[system.cone[position]].add(choice.transition.index)
            return len(states[index]) + len(transitions[index]) == wanted

        return explore(system, visit, budget)


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
    cut_short = transition.index in fireability.cut_short[automaton.index]
    if cut_short or fireability.may_fire(automaton.index, transition):
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
