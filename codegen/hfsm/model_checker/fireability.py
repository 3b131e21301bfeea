"""What each automaton can do at most, looked at by itself: cheap, whatever the number of automata.

An automaton alone is its states, the active time in each, and its guards. From that follow the transitions
that can fire at all and the states that they lead to. What is missing here is missing in every run: the
environment may wake an automaton and make it a ghost as it likes. For most automata the result is exact, too:
see `Fireability.exact`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from .events import Events
from .guards import Conjunction, satisfy
from .model import AutomatonModel, Model, StateModel, TransitionModel

__all__ = ["Fireability", "analyze"]

_FINISHED: Final = "children finished"
"""The atom that stands for `the children have finished`."""


@dataclass(frozen=True)
class Fireability:
    """The transitions that may fire and the states that may be entered, by automaton.

    An automaton is in `exact` when each of them is also known to be possible.
    """

    transitions: tuple[frozenset[int], ...]
    states: tuple[frozenset[int], ...]
    finishing: frozenset[int]
    events: frozenset[str]
    exact: frozenset[int]
    stuck: tuple[frozenset[int], ...]
    """The states that may be entered and, once it is there, hold an automaton for good."""

    def may_fire(self, automaton: int, transition: TransitionModel) -> bool:
        """Return whether a transition is not known never to fire."""
        return transition.index in self.transitions[automaton]


def analyze(model: Model, events: Events) -> Fireability:
    """Return what the automata of a model can do at most.

    What automata need of one another, events and finished children, starts at nothing and grows until it is
    what they give.
    """
    finishing: frozenset[int] = frozenset()
    sent = events.outside
    while True:
        alone = _all(model, finishing, sent)
        now_finishing = frozenset(
            index
            for index, (automaton, one) in enumerate(zip(model.automata, alone, strict=True))
            if any(automaton.states[state].final for state in one.states)
        )
        now_sent = events.sent_in(
            (automaton, one.states, one.transitions)
            for automaton, one in zip(model.automata, alone, strict=True)
        )
        if (now_finishing, now_sent) == (finishing, sent):
            break
        finishing, sent = now_finishing, now_sent
    return Fireability(
        transitions=tuple(one.transitions for one in alone),
        states=tuple(one.states for one in alone),
        finishing=finishing,
        events=sent,
        exact=frozenset(_exact(model, alone)),
        stuck=tuple(one.stuck for one in alone),
    )


@dataclass(frozen=True)
class _Alone:
    """What one automaton can do at most."""

    automaton: AutomatonModel
    transitions: frozenset[int]
    states: frozenset[int]
    resting: frozenset[int]
    """States in which it may stay as long as it likes."""
    stuck: frozenset[int]

    @cached_property
    def recurrent(self) -> frozenset[int]:
        """The states that it may enter again and again, without the end of any children."""
        targets: dict[int, set[int]] = {}
        for transition in self.automaton.transitions:
            if transition.index in self.transitions and not transition.finished:
                targets.setdefault(transition.origin, set()).add(transition.target)
        return frozenset(state for state in self.states if state in _reach(targets.get(state, ()), targets))


def _reach(starts: Iterable[int], targets: dict[int, set[int]]) -> set[int]:
    found = set(starts)
    new = list(found)
    while new:
        for target in targets.get(new.pop(), ()):
            if target not in found:
                found.add(target)
                new.append(target)
    return found


def _all(model: Model, finishing: frozenset[int], sent: frozenset[str]) -> list[_Alone]:
    found: list[_Alone] = []
    for automaton in model.automata:
        if automaton.parent >= 0:
            owner = model.automata[automaton.parent].states[automaton.owner]
            if owner.index not in found[automaton.parent].states or owner.final:
                found.append(_Alone(automaton, frozenset(), frozenset(), frozenset(), frozenset()))
                continue
        found.append(_alone(automaton, _is_aligned(model, automaton), finishing, sent))
    return found


def _is_aligned(model: Model, automaton: AutomatonModel) -> bool:
    """Return whether an automaton wakes and becomes a ghost only at times of its own cycles.

    Then its cycles come at whole multiples of its period in active time, too.
    """
    return all(above.interval % automaton.interval == 0 for above, _ in model.ancestors(automaton.index))


def _alone(
    automaton: AutomatonModel, aligned: bool, finishing: frozenset[int], sent: frozenset[str]
) -> _Alone:
    transitions: set[int] = set()
    resting: set[int] = set()
    fireable_in: dict[int, set[int]] = {}
    first = (automaton.initial, True)
    entered = {first}
    new = [first]
    while new:
        index, woken = new.pop()
        state = automaton.states[index]
        fireable, stays = _out_of(state, automaton.interval if aligned else 0, woken, finishing, sent)
        fireable_in.setdefault(index, set()).update(fireable)
        if stays:
            resting.add(index)
        for transition in state.outgoing:
            target = (transition.target, False)
            if transition.index in fireable and target not in entered:
                entered.add(target)
                new.append(target)
    transitions.update(*fireable_in.values())
    stuck = (
        index for index, fireable in fireable_in.items() if not fireable and not automaton.states[index].final
    )
    return _Alone(
        automaton, frozenset(transitions), frozenset(fireable_in), frozenset(resting), frozenset(stuck)
    )


def _out_of(
    state: StateModel, period: int, woken: bool, finishing: frozenset[int], sent: frozenset[str]
) -> tuple[set[int], bool]:
    """Return the transitions that can fire out of a state, and whether it may be stayed in.

    `period` is 0 where cycles may come at any active time. Only where the automaton is `woken` in the state
    is there a cycle at the moment of entry.
    """
    fireable: set[int] = set()
    if state.final:
        return fireable, True
    candidates = [
        (transition, needs)
        for transition in state.outgoing
        if (needs := _needs(transition, state, finishing, sent)) is not None
    ]
    stays = True
    for time in _moments(candidates, period, woken):
        enabled = [(transition, needs) for transition, needs in candidates if transition.delay <= time]
        for place, (transition, needs) in enumerate(enabled):
            if (
                transition.index not in fireable
                and satisfy(needs, (other for _, other in enabled[:place])) is not None
            ):
                fireable.add(transition.index)
        if satisfy((), (needs for _, needs in enabled)) is None:
            stays = False
            if period:  # something fires here at the latest
                break
    return fireable, stays


def _needs(
    transition: TransitionModel, state: StateModel, finishing: frozenset[int], sent: frozenset[str]
) -> Conjunction | None:
    if transition.needs is None or (transition.event and transition.event not in sent):
        return None
    if not transition.finished:
        return transition.needs
    if not state.children or not finishing.issuperset(state.children):
        return None
    return ((_FINISHED, True), *transition.needs)


def _moments(
    candidates: list[tuple[TransitionModel, Conjunction]], period: int, woken: bool
) -> Iterator[int]:
    """Yield an active time of a cycle from each interval between delays that has one."""
    times = sorted({0, *(transition.delay for transition, _ in candidates)})
    for place, time in enumerate(times):
        end = times[place + 1] if place + 1 < len(times) else None
        moment = time
        if period:
            moment = -(-time // period) * period
            if moment == 0 and not woken:
                moment = period
        if end is None or moment < end:
            yield moment


def _exact(model: Model, alone: list[_Alone]) -> Iterator[int]:
    """Yield the automata whose possibilities are all real.

    They keep to their own rhythm, need no end of children, and have as much active time as they like: every
    state above may be stayed in, or is entered again and again and lets them go on where they were.
    """
    exact: set[int] = set()
    for automaton, one in zip(model.automata, alone, strict=True):
        if any(
            transition.finished and transition.index in one.transitions
            for transition in automaton.transitions
        ):
            continue
        if automaton.parent >= 0:
            above = alone[automaton.parent]
            owner = above.automaton.states[automaton.owner]
            lasts = owner.index in above.resting or (owner.index in above.recurrent and not owner.restart)
            if automaton.parent not in exact or not lasts or not _is_aligned(model, automaton):
                continue
        exact.add(automaton.index)
        yield automaton.index
