"""What each automaton can do at most, looked at one by one: cheap, whatever the number of automata.

The environment of an automaton wakes it and makes it a ghost as it likes, which is more than it can, and
sends the events that may come from outside or from code that may run. What is missing here is missing in
every run. For most automata the result is exact, too: see `Fireability.exact`. Times are active time in ns
since the automaton began.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Final

from ...diagnostics import Note
from ..analysis import Analysis
from ..code.language import is_foreign
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


@dataclass(frozen=True)
class Fireability:
    """The transitions that may fire and the states that may be entered, by automaton, at most.

    `finishing` are the automata that may finish, `events` those that may come.
    """

    transitions: tuple[frozenset[int], ...]
    states: tuple[frozenset[int], ...]
    finishing: frozenset[int]
    events: frozenset[str]

    def may_fire(self, automaton: int, transition: TransitionModel) -> bool:
        """Return whether a transition is not known never to fire."""
        return transition.index in self.transitions[automaton]


def analyze(model: Model, events: Events) -> Fireability:
    """Return what the automata of a model can do at most, each looked at by itself.

    What automata need of one another, events and finished children, starts at nothing and grows until it is
    what they give.
    """
    finished: frozenset[int] = frozenset()
    coming = events.outside
    while True:
        found = [_Solitary(model, automaton, finished, coming) for automaton in model.automata]
        for automaton, one in zip(model.automata, found, strict=True):
            if automaton.parent >= 0:
                owner = model.automata[automaton.parent].states[automaton.owner]
                if owner.final or owner.index not in found[automaton.parent].states:
                    one.states, one.transitions = frozenset(), frozenset()
        finishing = frozenset(
            automaton.index
            for automaton, one in zip(model.automata, found, strict=True)
            if any(automaton.states[state].final for state in one.states)
        )
        sent = events.sent_in(
            (automaton, one.states, one.transitions)
            for automaton, one in zip(model.automata, found, strict=True)
        )
        if (finishing, sent) == (finished, coming):
            return Fireability(
                transitions=tuple(one.transitions for one in found),
                states=tuple(one.states for one in found),
                finishing=finishing,
                events=sent,
            )
        finished, coming = finishing, sent


class _Solitary:
    """What an automaton can do at most: its `states` and `transitions`."""

    def __init__(
        self, model: Model, automaton: AutomatonModel, finished: frozenset[int], events: frozenset[str]
    ) -> None:
        self._automaton, self._finished, self._events = automaton, finished, events
        self._is_aligned = all(
            above.interval % automaton.interval == 0 for above, _ in model.ancestors(automaton.index)
        )
        """Whether it wakes and becomes a ghost only at times of its own cycles.

        Then its cycles come at whole multiples of its period in active time, too.
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
            for place, (transition, needs) in enumerate(enabled):
                if satisfy(needs, (other for _, other in enabled[:place])) is not None:
                    yield transition
            if self._is_aligned and satisfy((), (needs for _, needs in enabled)) is None:
                return  # something fires here at the latest

    def _needs(self, transition: TransitionModel, state: StateModel) -> Conjunction | None:
        if transition.needs is None or (transition.event and transition.event not in self._events):
            return None
        if not transition.finished:
            return transition.needs
        if not state.children or not self._finished.issuperset(state.children):
            return None
        return ((_FINISHED, True), *transition.needs)

    def _moments(self, candidates: _Candidates, began: bool) -> Iterator[int]:
        """Yield an active time from each interval between delays in which there may be a cycle."""
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
