"""What each automaton can do at most, looked at one by one: cheap, whatever the number of automata.

The environment of an automaton wakes it and makes it a ghost as it likes, which is more than it can. What is
missing here is missing in every run. For most automata the result is exact, too: see `Fireability.exact`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from .events import Events
from .model import AutomatonModel, Model, TransitionModel
from .solitary import Rhythm, Solitary, Surroundings, examine

__all__ = ["Fireability", "analyze"]


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
