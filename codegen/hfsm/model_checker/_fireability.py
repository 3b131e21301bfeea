"""Bound what each automaton can do, one by one: cheap for any number of automata.

The environment of an automaton may wake it or make it a ghost at any time, and send any event that may come
from outside or from code that may run. This allows too much, so that anything missing here is missing in
every run. Times are active times in ns since the automaton began.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from ...diagnostics import Note
from ...logic import Conjunction, satisfy
from .._effects import CodeEffects
from ..code.language import is_foreign
from ..document import REFUSED, Text
from .model import AutomatonModel, Model, StateModel, TransitionModel


@dataclass(frozen=True)
class Events:
    """The events that may arrive at any time: from `outside`, and from functions.

    Code at `places`, which cannot be followed, may also send the `unclear` ones.
    """

    outside: frozenset[str]
    unclear: frozenset[str] = frozenset()
    places: tuple[Note, ...] = ()


def events_of(model: Model) -> Events:
    """Return the events that may arrive whatever the automata do.

    Any code that cannot be followed may send the unclear ones, as may hand-written code beside the document.
    """
    document, automata = model.document, model.automata
    waited_for = frozenset(each.event for one in automata for each in one.transitions if each.event)
    declared = frozenset((REFUSED, *(event.name.strip() for event in document.events)))
    if is_foreign(document):
        return Events(waited_for | declared)
    always = [text for automaton in document.automata for text in (automaton.functions, automaton.variables)]
    always += [functions.text for functions in document.functions]
    outside = declared | sent_by(model.effects, always)
    places = model.effects.unclear_sends if waited_for - outside else ()
    return Events(outside, waited_for - outside if places else frozenset(), places)


def sent_by(effects: CodeEffects, texts: Iterable[Text]) -> frozenset[str]:
    """Return the events that code is known to send."""
    return frozenset[str]().union(*(effects.of(text).events for text in texts))


def _running(
    automaton: AutomatonModel, states: Collection[int], transitions: Collection[int]
) -> Iterator[Text]:
    """Yield the code that may run when these states and transitions of an automaton are possible."""
    for state in automaton.states:
        if state.index in states:
            yield from (state.source.entry, state.source.code, state.source.exit)
            yield from (argument.value for argument in state.source.arguments)
    for transition in automaton.transitions:
        if states:  # guards are evaluated even if they do not hold
            yield from (transition.source.guard, transition.source.trigger)
        if transition.index in transitions:
            yield transition.source.code


@dataclass(frozen=True)
class Fireability:
    """The transitions that may fire and the states that may be entered, by automaton.

    `finishing` are the automata that may finish, `events` the events that may arrive.
    """

    model: Model
    transitions: tuple[frozenset[int], ...]
    states: tuple[frozenset[int], ...]
    finishing: frozenset[int]
    events: frozenset[str]

    def may_fire(self, automaton: int, transition: TransitionModel) -> bool:
        """Return whether a transition may fire."""
        return transition.index in self.transitions[automaton]


def fireability_of(model: Model, outside: frozenset[str]) -> Fireability:
    """Return the most that the automata of a model can do when events arrive from `outside`.

    What they need from each other, events and finished children, grows from nothing to a fixed point.
    """
    finished, coming = frozenset[int](), outside
    while True:
        states: list[frozenset[int]] = []
        transitions: list[frozenset[int]] = []
        sent = outside
        for automaton in model.automata:
            owner = (
                model.automata[automaton.parent].states[automaton.owner] if automaton.parent >= 0 else None
            )
            if owner is None or (not owner.final and owner.index in states[automaton.parent]):
                alone = _Possible(model, automaton, finished, coming)
                states.append(alone.states)
                transitions.append(alone.transitions)
            else:
                states.append(frozenset())
                transitions.append(frozenset())
            sent |= sent_by(model.effects, _running(automaton, states[-1], transitions[-1]))
        finishing = frozenset(
            automaton.index
            for automaton in model.automata
            if any(automaton.states[state].final for state in states[automaton.index])
        )
        if (finishing, sent) == (finished, coming):
            return Fireability(model, tuple(transitions), tuple(states), finished, sent)
        finished, coming = finishing, sent


_FINISHED: Final = "children finished"
"""The atom of a transition that waits for its children to finish."""

_Entry = tuple[int, bool]
"""A state, and whether the automaton began there; otherwise a transition led there."""

_Candidates = list[tuple[TransitionModel, Conjunction]]


class _Possible:
    """The `states` and `transitions` that are possible in an automaton."""

    def __init__(
        self, model: Model, automaton: AutomatonModel, finished: frozenset[int], events: frozenset[str]
    ) -> None:
        self._automaton = automaton
        self._finished = finished
        self._events = events
        self._is_aligned = all(
            above.interval % automaton.interval == 0 for above, _ in model.ancestors(automaton.index)
        )
        """True if it wakes and becomes a ghost only at the times of its cycles.

        Its cycles then come at whole multiples of its period in active time, too.
        """
        entries: dict[_Entry, None] = {(automaton.initial, True): None}
        transitions: set[int] = set()
        waiting = list(entries)
        for entry in waiting:  # grows
            for transition in self._out_of(entry):
                transitions.add(transition.index)
                target = (transition.target, False)
                if target not in entries:
                    entries[target] = None
                    waiting.append(target)
        self.states = frozenset(state for state, _ in entries)
        self.transitions = frozenset(transitions)

    def _out_of(self, entry: _Entry) -> Iterator[TransitionModel]:
        """Yield the transitions that can fire out of a state."""
        state = self._automaton.states[entry[0]]
        if state.final:
            return
        candidates = [
            (transition, needs)
            for transition in state.outgoing
            if (needs := self._needs(transition, state)) is not None
        ]
        for moment in self._moments(candidates, entry[1]):
            enabled = [(transition, needs) for transition, needs in candidates if transition.delay <= moment]
            linked = [link for transition, _ in enabled for link in transition.links]
            for place, (transition, needs) in enumerate(enabled):
                if satisfy(needs, (*linked, *(other for _, other in enabled[:place]))) is not None:
                    yield transition
            if self._is_aligned and satisfy((), (*linked, *(needs for _, needs in enabled))) is None:
                return  # something fires by now

    def _needs(self, transition: TransitionModel, state: StateModel) -> Conjunction | None:
        if transition.needs is None or (transition.event and transition.event not in self._events):
            return None
        if not transition.finished:
            return transition.needs
        if not state.children or not self._finished.issuperset(state.children):
            return None
        return ((_FINISHED, True), *transition.needs)

    def _moments(self, candidates: _Candidates, began: bool) -> Iterator[int]:
        """Yield an active time from each interval between delays that may have a cycle."""
        period = self._automaton.interval
        times = sorted({0, *(transition.delay for transition, _ in candidates)})
        for time, end in zip(times, [*times[1:], None], strict=True):
            moment = -(-time // period) * period
            if moment == 0 and not began:
                moment = period
            if not self._is_aligned:
                yield time
            elif end is None or moment < end:
                yield moment
