"""Find which states can be entered and which transitions can fire, and why others cannot."""

from __future__ import annotations

from collections.abc import KeysView, Mapping
from dataclasses import dataclass
from enum import StrEnum

from ...graphs import reached
from ...logic import satisfy
from ._exploration import Budget, Exploration, newness
from ._fireability import Fireability
from ._solitary import Obstacle, Solitary
from .model import AutomatonModel, StateModel, TransitionModel
from .transition_system import TransitionSystem, refused_by


class Reachability(StrEnum):
    """An answer to the question if a state can be entered, or a transition can fire."""

    POSSIBLE = "possible"
    IMPOSSIBLE = "impossible"
    UNDECIDED = "undecided"


class WhyNever(StrEnum):
    """Why a transition never fires; of states, only GRAPH is reported."""

    NONE = ""
    GRAPH = "graph"
    """No transitions lead there, even if all of them fire."""
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
    """The states above are left too early, or no cycle comes in time."""


@dataclass(frozen=True, slots=True)
class StateResult:
    """The reachability of a state, by the ids of the document."""

    automaton: int
    state: int
    reachability: Reachability
    why: WhyNever = WhyNever.NONE


@dataclass(frozen=True, slots=True)
class TransitionResult:
    """The reachability of a transition; `earlier` are the ids of transitions that always fire before it."""

    automaton: int
    transition: int
    reachability: Reachability
    why: WhyNever = WhyNever.NONE
    earlier: tuple[int, ...] = ()


@dataclass(frozen=True)
class Reached:
    """The states and transitions that were reached, by automaton."""

    states: tuple[frozenset[int], ...]
    transitions: tuple[frozenset[int], ...]
    unknown: frozenset[int]
    """Automata in which more may be possible: their search was not complete."""
    obstacles: Mapping[int, Obstacle]
    """The obstacles to deciding these automata without a search, in them or in some above them."""


def find_reachable(fireability: Fireability, budget: Budget) -> Reached:
    """Search what is possible in each automaton, together with those that it depends on."""
    model = fireability.model
    seen: set[tuple[int, ...]] = set()
    transitions: list[set[int]] = [set() for _ in model.automata]
    unknown: set[int] = set()
    live = [index for index, possible in enumerate(fireability.states) if possible]

    def is_settled(index: int) -> bool:
        return transitions[index] == fireability.transitions[index] and all(
            (index, state) in seen for state in fireability.states[index]
        )

    solitary = Solitary(fireability)
    for done, index in enumerate(live):
        if is_settled(index):
            continue
        alone = solitary.reached(index, budget.share(len(live) - done))
        if alone is not None:
            seen.update((index, state) for state in alone.states)
            transitions[index] |= alone.transitions
            continue
        system = TransitionSystem([index], fireability)
        is_new = newness(system, seen)
        exploration = Exploration(system, budget.share(len(live) - done), is_new=is_new)
        is_new(exploration.start)
        for move in exploration.moves():
            if move.choice.transition is not None:
                transitions[system.cone[move.node.position]].add(move.choice.transition.index)
            if is_settled(index):
                break
        if not exploration.complete and not is_settled(index):
            unknown.add(index)
    above = {automaton.index for index in unknown for automaton, _ in model.ancestors(index)}
    return Reached(
        states=tuple(
            frozenset(state.index for state in automaton.states if (automaton.index, state.index) in seen)
            for automaton in model.automata
        ),
        transitions=tuple(map(frozenset, transitions)),
        unknown=frozenset(unknown),
        obstacles={
            index: solitary.obstacles[index]
            for index in sorted(unknown | above)
            if index in solitary.obstacles
        },
    )


def state_results(fireability: Fireability, reached: Reached) -> list[StateResult]:
    """Return the result of every state."""
    results = []
    for automaton in fireability.model.automata:
        index, connected = automaton.index, by_graph(automaton)
        for state in automaton.states:
            may_be = index in reached.unknown and state.index in fireability.states[index]
            found = _verdict(state.index in reached.states[index], may_be)
            is_cut_off = bool(reached.states[index]) and state.index not in connected
            why = WhyNever.GRAPH if is_cut_off else WhyNever.NONE
            results.append(StateResult(automaton.source.id, state.source.id, found, why))
    return results


def transition_results(fireability: Fireability, reached: Reached) -> list[TransitionResult]:
    """Return the result of every transition."""
    results = []
    for automaton in fireability.model.automata:
        index = automaton.index
        for state in automaton.states:
            for transition in state.outgoing:
                may_be = index in reached.unknown and fireability.may_fire(index, transition)
                found = _verdict(transition.index in reached.transitions[index], may_be)
                why, earlier = WhyNever.NONE, tuple[int, ...]()
                if found is Reachability.IMPOSSIBLE:
                    why, earlier = _why_never(automaton, state, transition, fireability, reached)
                results.append(
                    TransitionResult(automaton.source.id, transition.source.id, found, why, earlier)
                )
    return results


def _verdict(is_seen: bool, may_be: bool) -> Reachability:
    if is_seen:
        return Reachability.POSSIBLE
    return Reachability.UNDECIDED if may_be else Reachability.IMPOSSIBLE


def by_graph(automaton: AutomatonModel) -> KeysView[int]:
    """Return the states to which transitions lead from the initial one, if all of them can fire."""
    states = automaton.states
    return reached([automaton.initial], lambda state: (each.target for each in states[state].outgoing))


def _why_never(
    automaton: AutomatonModel,
    state: StateModel,
    transition: TransitionModel,
    fireability: Fireability,
    reached: Reached,
) -> tuple[WhyNever, tuple[int, ...]]:
    """Return why a transition never fires, and the ids of those that always fire before it."""
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
    """Return the ids of the transitions that keep one from firing: one that is enough alone, or all."""
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
        if not other.finished
        and satisfy(transition.needs or (), (*transition.links, *refused_by([other]))) is None
    ]
    return tuple(other.source.id for other in (alone[:1] or others))
