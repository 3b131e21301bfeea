"""What each automaton can do at most, looked at one by one: cheap, whatever the number of automata.

The environment of an automaton wakes it and makes it a ghost as it likes, which is more than it can, and
sends the events that may come from outside or from code that may run. What is missing here is missing in
every run. For most automata the result is exact, too: see `Fireability.exact`. Times are active time in ns
since the automaton began.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import Final

from ...diagnostics import Note
from ..analysis import Analysis
from ..code.pieces import is_foreign
from ..document import Text
from ..sends import sends_of, unclear_sends
from .guards import Conjunction, satisfy
from .model import AutomatonModel, Model, StateModel, TransitionModel

__all__ = ["Events", "Fireability", "analyze", "events_of"]


@dataclass(frozen=True)
class Events:
    """The events of a document. Those from `outside` and from functions may arrive at any time.

    Code that cannot be followed may send `unclear` ones.
    """

    all: frozenset[str]
    outside: frozenset[str]
    unclear: frozenset[str] = frozenset()
    analysis: Analysis = field(kw_only=True, repr=False, compare=False)
    places: tuple[Note, ...] = ()
    """Where the code is that cannot be followed."""

    @property
    def certain(self) -> Events:
        """The same without what is unclear."""
        return replace(self, outside=self.outside - self.unclear, unclear=frozenset(), places=())

    def sent_in(
        self, possible: Iterable[tuple[AutomatonModel, Collection[int], Collection[int]]]
    ) -> frozenset[str]:
        """Return the events that may arrive when these states and transitions of automata are possible."""
        sent = set(self.outside)
        for automaton, states, transitions in possible:
            for state in automaton.states:
                if state.index in states:
                    source = state.source
                    values = [argument.value for argument in source.arguments]
                    sent |= self._sent(source.entry, source.code, source.exit, *values)
            for transition in automaton.transitions:
                if transition.index in transitions:
                    sent |= self._sent(transition.source.code)
            if states:  # guards are asked although they do not hold
                sent |= self._sent(
                    *(
                        text
                        for item in automaton.transitions
                        for text in (item.source.guard, item.source.trigger)
                    )
                )
        return frozenset(sent)

    def _sent(self, *texts: Text) -> frozenset[str]:
        return _names(self.analysis, texts)


def _names(analysis: Analysis, texts: Iterable[Text]) -> frozenset[str]:
    """Return the events that code certainly sends."""
    pieces = map(analysis.piece, texts)
    return frozenset[str]().union(*(sends_of(piece.tree).names for piece in pieces if piece is not None))


def events_of(model: Model) -> Events:
    """Return the events that the transitions of a document wait for, and those that come from outside.

    What functions and variables send counts as from outside: they may be called from anywhere. All code
    counts as able to send what cannot be followed, and so does hand-written code beside the document.
    """
    document = model.document
    waited_for = frozenset(
        transition.event
        for automaton in model.automata
        for transition in automaton.transitions
        if transition.event
    )
    declared = frozenset(event.name.strip() for event in document.events)
    analysis = model.analysis
    if is_foreign(document):
        return Events(waited_for, waited_for | declared, analysis=analysis)
    always = [text for automaton in document.automata for text in (automaton.functions, automaton.variables)]
    always += [functions.text for functions in document.functions]
    outside = declared | _names(analysis, always)
    places = tuple(unclear_sends(analysis)) if waited_for - outside else ()
    unclear = waited_for - outside if places else frozenset()
    return Events(waited_for, outside | unclear, unclear, analysis=analysis, places=places)


_FINISHED: Final = "children finished"
"""The atom that stands for `the children have finished`."""

_Entry = tuple[int, bool]
"""A state, and whether the automaton began in it; else a transition led there."""

_Candidates = list[tuple[TransitionModel, Conjunction]]


class Rhythm(Enum):
    """At which active times in a state there are cycles."""

    REGULAR = "regular"
    """At multiples of the period, and at 0 where the automaton began."""
    SHIFTED = "shifted"
    """As regular ones, but that the first comes at any time within a period where the automaton began."""
    ANY = "any"
    """At any times."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What others do: automata that may have `finished`, `events` that may come, and the `lifetime`.

    An automaton runs no cycle at its lifetime or later, None for one without an end.
    """

    finished: frozenset[int]
    events: frozenset[str]
    lifetime: int | None = None


@dataclass
class Solitary:
    """What an automaton can do: when its `transitions` fire at the earliest, when its `entries` are."""

    automaton: AutomatonModel
    transitions: dict[int, int] = field(default_factory=dict)
    entries: dict[_Entry, int] = field(default_factory=dict)
    stays: dict[_Entry, int] = field(default_factory=dict)
    """How long it stays in a state at most, for states that are always left."""

    @cached_property
    def states(self) -> frozenset[int]:
        """The states that it may enter."""
        return frozenset(state for state, _ in self.entries)

    @cached_property
    def resting(self) -> frozenset[int]:
        """The states in which it may stay as long as it likes."""
        return frozenset(entry[0] for entry in self.entries if entry not in self.stays)

    @cached_property
    def stuck(self) -> frozenset[int]:
        """The states, none of them final, that it never leaves."""
        left = {item.origin for item in self.automaton.transitions if item.index in self.transitions}
        return frozenset(state for state in self.states - left if not self.automaton.states[state].final)

    @cached_property
    def recurrent(self) -> frozenset[int]:
        """The states that it may enter again and again, without the end of any children."""
        targets: dict[int, set[int]] = {}
        for transition in self.automaton.transitions:
            if transition.index in self.transitions and not transition.finished:
                targets.setdefault(transition.origin, set()).add(transition.target)
        return frozenset(
            state for state in self.states if state in _reach(targets.get(state, set()), targets)
        )

    def longest(self, state: int, lifetime: int | None) -> int | None:
        """Return how long it may be in a state without a break, None for ever."""
        stays: list[int] = []
        for entry, time in self.entries.items():
            if entry[0] == state:
                ends = [*([self.stays[entry]] if entry in self.stays else [])]
                ends += [lifetime - time] if lifetime is not None else []
                if not ends:
                    return None
                stays.append(min(ends))
        return max(stays, default=0)


def _reach(starts: set[int], targets: dict[int, set[int]]) -> set[int]:
    found = set(starts)
    new = list(found)
    while new:
        for target in targets.get(new.pop(), ()):
            if target not in found:
                found.add(target)
                new.append(target)
    return found


def examine(automaton: AutomatonModel, rhythm: Rhythm, surroundings: Surroundings) -> Solitary:
    """Return what an automaton can do in a rhythm.

    It is all that it can do, except for a SHIFTED rhythm: there it is what it can do for certain.
    """
    found = Solitary(automaton)
    first = (automaton.initial, True)
    found.entries[first] = 0
    waiting = [(0, first)]
    while waiting:
        time, entry = heapq.heappop(waiting)
        if found.entries[entry] < time:
            continue
        for moment, transition in _out_of(found, entry, rhythm, surroundings):
            fires = time + moment
            if surroundings.lifetime is not None and fires >= surroundings.lifetime:
                continue
            if fires < found.transitions.get(transition.index, fires + 1):
                found.transitions[transition.index] = fires
            target = (transition.target, False)
            if fires < found.entries.get(target, fires + 1):
                found.entries[target] = fires
                heapq.heappush(waiting, (fires, target))
    return found


def _out_of(
    found: Solitary, entry: _Entry, rhythm: Rhythm, surroundings: Surroundings
) -> Iterator[tuple[int, TransitionModel]]:
    """Yield the transitions that can fire out of a state, with the earliest active time in it."""
    state = found.automaton.states[entry[0]]
    if state.final:
        return
    candidates = [
        (transition, needs)
        for transition in state.outgoing
        if (needs := _needs(transition, state, surroundings)) is not None
    ]
    told: set[int] = set()
    for moment, certain in _moments(candidates, found.automaton.interval, rhythm, entry[1]):
        enabled = [(transition, needs) for transition, needs in candidates if transition.delay <= moment]
        for place, (transition, needs) in enumerate(enabled if certain else ()):
            if transition.index in told:
                continue
            if satisfy(needs, (other for _, other in enabled[:place])) is not None:
                told.add(transition.index)
                yield moment, transition
        if satisfy((), (needs for _, needs in enabled)) is None:  # something fires here at the latest
            found.stays.setdefault(entry, moment)
            if rhythm is not Rhythm.ANY:
                return


def _needs(transition: TransitionModel, state: StateModel, surroundings: Surroundings) -> Conjunction | None:
    if transition.needs is None or (transition.event and transition.event not in surroundings.events):
        return None
    if not transition.finished:
        return transition.needs
    if not state.children or not surroundings.finished.issuperset(state.children):
        return None
    return ((_FINISHED, True), *transition.needs)


def _moments(candidates: _Candidates, period: int, rhythm: Rhythm, began: bool) -> Iterator[tuple[int, bool]]:
    """Yield an active time from each interval between delays, and whether it certainly has a cycle."""
    times = sorted({0, *(transition.delay for transition, _ in candidates)})
    for place, time in enumerate(times):
        end = times[place + 1] if place + 1 < len(times) else None
        if rhythm is Rhythm.ANY:
            yield time, True
        elif rhythm is Rhythm.SHIFTED and began:
            yield time, end is None or end - time >= period
        else:
            moment = -(-time // period) * period
            if moment == 0 and not began:
                moment = period
            if end is None or moment < end:
                yield moment, True


@dataclass(frozen=True)
class Fireability:
    """The transitions that may fire and the states that may be entered, by automaton.

    The `certain` ones are known to be possible, and in an automaton in `exact` all of them are.
    """

    transitions: tuple[frozenset[int], ...]
    states: tuple[frozenset[int], ...]
    certain_transitions: tuple[frozenset[int], ...]
    certain_states: tuple[frozenset[int], ...]
    exact: frozenset[int]
    finishing: frozenset[int]
    """The automata that may finish."""
    events: frozenset[str]
    stuck: tuple[frozenset[int], ...]
    """The states that hold an automaton for good once it is there."""
    cut_short: tuple[frozenset[int], ...]
    """The transitions that would fire if the states above were not left before."""

    def may_fire(self, automaton: int, transition: TransitionModel) -> bool:
        """Return whether a transition is not known never to fire."""
        return transition.index in self.transitions[automaton]


def analyze(model: Model, events: Events) -> Fireability:
    """Return what the automata of a model can do at most.

    What automata need of one another, events and finished children, starts at nothing and grows until it is
    what they give.
    """
    surroundings = Surroundings(frozenset(), events.outside)
    while True:
        analysis = _Analysis(model, surroundings)
        found = Surroundings(analysis.finishing, events.sent_in(analysis.possible))
        if found == surroundings:
            return analysis.result()
        surroundings = found


class _Analysis:
    """All automata, each after its ancestors, in given surroundings."""

    def __init__(self, model: Model, surroundings: Surroundings) -> None:
        self._model = model
        self._surroundings = surroundings
        self._at_most: list[Solitary] = []
        self._lifetimes: list[int | None] = []
        self._certain: list[Solitary | None] = []
        """What automata do that may run without a break for as long as they like, None for others."""
        self._exact: set[int] = set()
        self._cut_short: list[frozenset[int]] = []
        for automaton in model.automata:
            self._add(automaton)

    @property
    def finishing(self) -> frozenset[int]:
        """The automata that may finish."""
        return frozenset(
            one.automaton.index
            for one in self._at_most
            if any(one.automaton.states[state].final for state in one.states)
        )

    @property
    def possible(self) -> list[tuple[AutomatonModel, frozenset[int], frozenset[int]]]:
        """The automata with their states and transitions."""
        return [(one.automaton, one.states, frozenset(one.transitions)) for one in self._at_most]

    def result(self) -> Fireability:
        """Return what was found."""
        nothing: frozenset[int] = frozenset()
        certain = [
            one if one.automaton.index in self._exact else self._certain[one.automaton.index]
            for one in self._at_most
        ]
        return Fireability(
            transitions=tuple(frozenset(one.transitions) for one in self._at_most),
            states=tuple(one.states for one in self._at_most),
            certain_transitions=tuple(frozenset(one.transitions) if one else nothing for one in certain),
            certain_states=tuple(one.states if one else nothing for one in certain),
            exact=frozenset(self._exact),
            finishing=self.finishing,
            events=self._surroundings.events,
            stuck=tuple(one.stuck for one in self._at_most),
            cut_short=tuple(self._cut_short),
        )

    def _add(self, automaton: AutomatonModel) -> None:
        aligned = self._is_aligned(automaton)
        lifetime: int | None = None
        if automaton.parent >= 0:
            above = self._at_most[automaton.parent]
            owner = above.automaton.states[automaton.owner]
            if owner.index not in above.states or owner.final:
                self._lifetimes.append(0)
                self._at_most.append(Solitary(automaton))
                self._certain.append(None)
                self._cut_short.append(frozenset())
                self._exact.add(automaton.index)
                return
            if owner.restart and aligned and self._is_aligned(above.automaton):
                lifetime = above.longest(owner.index, self._lifetimes[automaton.parent])
        self._lifetimes.append(lifetime)
        around = Surroundings(self._surroundings.finished, self._surroundings.events, lifetime)
        rhythm = Rhythm.REGULAR if aligned else Rhythm.ANY
        one = examine(automaton, rhythm, around)
        self._at_most.append(one)
        for_ever = one if lifetime is None else examine(automaton, rhythm, replace(around, lifetime=None))
        self._cut_short.append(frozenset(for_ever.transitions.keys() - one.transitions.keys()))
        self._certain.append(self._undisturbed(automaton, aligned))
        if self._is_exact(automaton, aligned, one):
            self._exact.add(automaton.index)

    def _is_aligned(self, automaton: AutomatonModel) -> bool:
        """Return whether an automaton wakes and becomes a ghost only at times of its own cycles.

        Then its cycles come at whole multiples of its period in active time, too.
        """
        return all(
            above.interval % automaton.interval == 0 for above, _ in self._model.ancestors(automaton.index)
        )

    def _undisturbed(self, automaton: AutomatonModel, aligned: bool) -> Solitary | None:
        """Return what an automaton does for certain if all above may stay where they are, else None."""
        if _waits_for_children(automaton, self._at_most[automaton.index]):
            return None
        if automaton.parent >= 0:
            above = self._certain[automaton.parent]
            if above is None or automaton.owner not in above.resting:
                return None
        around = Surroundings(frozenset(), self._surroundings.events)
        return examine(automaton, Rhythm.REGULAR if aligned else Rhythm.SHIFTED, around)

    def _is_exact(self, automaton: AutomatonModel, aligned: bool, one: Solitary) -> bool:
        """Return whether all that an automaton can do at most is possible."""
        certain = self._certain[automaton.index]
        if certain is not None and certain.transitions.keys() == one.transitions.keys():
            return True
        if _waits_for_children(automaton, one) or not aligned or automaton.parent not in self._exact:
            return False
        above = self._at_most[automaton.parent]
        if above.automaton.states[automaton.owner].restart:
            # its lifetime is that of one visit to the state above
            return self._is_aligned(above.automaton) and self._lifetimes[automaton.index] != 0
        return self._lifetimes[automaton.parent] is None and automaton.owner in above.recurrent


def _waits_for_children(automaton: AutomatonModel, one: Solitary) -> bool:
    return any(
        transition.finished and transition.index in one.transitions for transition in automaton.transitions
    )
