"""The exact behavior of some automata, cycle by cycle, with guards that may be true or false.

A node is a configuration and the cycle that comes next: which automaton at which moment. Cycles in which
nothing can change are left out, so that time jumps from one that matters to the next. What the runtime does
in virtual time is a path through these nodes, and every path is what it does for some values of the guards.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from .fireability import Fireability
from .guards import Conjunction, satisfy
from .model import Model, TransitionModel

__all__ = ["ACTIVE", "BEGUN", "FINISHED", "Choice", "Configuration", "Local", "Node", "TransitionSystem"]

ACTIVE: Final = 1
FINISHED: Final = 2
OWED: Final = 4
"""The entry into the current state has not run: its timers stand still and its children sleep."""
BEGUN: Final = 8
"""It has been active before."""

Local = tuple[int, int, int]
"""One automaton: its state, flags, and the active time in the state in ns, as far as a timer cares."""

Configuration = tuple[Local, ...]
"""The automata of a cone, in the order of the model."""


class Choice(NamedTuple):
    """What a cycle comes to: the transition that fires, or none, and the atoms that must be true for it."""

    transition: TransitionModel | None
    true: frozenset[str]


class Node(NamedTuple):
    """A configuration before the cycle of the automaton at `position`; -1 when nothing can ever happen.

    `phase` is the time of the cycle within the common multiple of all periods.
    """

    configuration: Configuration
    phase: int
    position: int


@dataclass(frozen=True, slots=True)
class _State:
    final: bool
    owes: bool
    restart: bool
    children: tuple[int, ...]
    outgoing: tuple[TransitionModel, ...]
    clamp: int
    """The longest delay out of it: a longer active time makes no difference."""


class TransitionSystem:
    """The automata of a `cone`, indices of the model, which must hold all that they depend on."""

    def __init__(self, model: Model, cone: Collection[int], fireability: Fireability) -> None:
        self.cone = tuple(sorted(cone))
        """The automata, each before its children."""
        self.position = {index: position for position, index in enumerate(self.cone)}
        """Where each of them is in a configuration."""
        self._intervals = tuple(model.automata[index].interval for index in self.cone)
        self.common = math.lcm(*self._intervals)
        self._initial = tuple(model.automata[index].initial for index in self.cone)
        self._states = tuple(
            tuple(
                _State(
                    final=state.final,
                    owes=state.owes,
                    restart=state.restart,
                    children=tuple(
                        self.position[child] for child in state.children if child in self.position
                    ),
                    outgoing=tuple(
                        transition for transition in state.outgoing if fireability.may_fire(index, transition)
                    ),
                    clamp=max((t.delay for t in state.outgoing if fireability.may_fire(index, t)), default=0),
                )
                for state in model.automata[index].states
            )
            for index in self.cone
        )
        self._resting: dict[tuple[int, int], bool] = {}
        self._choices: dict[tuple[int, int, tuple[int, ...]], tuple[Choice, ...]] = {}

    def start(self) -> tuple[Configuration, Node, int]:
        """Return the first configuration, the first node, and the ns until its cycle."""
        locals_: list[Local] = [(initial, 0, 0) for initial in self._initial]
        self._begin(locals_, 0, anew=True)
        configuration = tuple(locals_)
        node, elapsed = self._next(configuration, 0, -1)
        return configuration, node, elapsed

    def successors(self, node: Node) -> Iterator[tuple[Choice, Configuration, Node, int]]:
        """Yield each outcome of a cycle: the configuration after it, the next node, and the ns until that."""
        if node.position < 0:
            return
        for choice in self._choices_at(node):
            configuration = self._cycle(node.configuration, node.position, choice.transition)
            following, elapsed = self._next(configuration, node.phase, node.position)
            yield choice, configuration, following, elapsed

    def may_rest(self, configuration: Configuration) -> bool:
        """Return whether nothing need ever change any more: whatever could change waits for a guard."""
        for position, (index, flags, _) in enumerate(configuration):
            if flags & (ACTIVE | FINISHED) == ACTIVE and (flags & OWED or not self._rests(position, index)):
                return False
        return True

    def _rests(self, position: int, index: int) -> bool:
        known = self._resting.get((position, index))
        if known is None:
            state = self._states[position][index]
            needs = (transition.needs or () for transition in state.outgoing)
            known = not state.final and satisfy((), needs) is not None
            self._resting[position, index] = known
        return known

    def enabled(self, node: Node) -> list[TransitionModel]:
        """Return the transitions whose guards are asked in the cycle, in order, should none of them hold."""
        position = node.position
        locals_: Configuration = node.configuration
        index, flags, waited = locals_[position]
        state = self._states[position][index]
        if flags & OWED:
            waited = 0
        if state.final:
            return []
        finished = self._have_finished(locals_, state) and not flags & OWED
        return [
            transition
            for transition in state.outgoing
            if transition.delay <= waited and (finished or not transition.finished)
        ]

    def _choices_at(self, node: Node) -> tuple[Choice, ...]:
        enabled = self.enabled(node)
        key = node.position, node.configuration[node.position][0], tuple(t.index for t in enabled)
        known = self._choices.get(key)
        if known is None:
            known = self._choices[key] = tuple(_choices(enabled))
        return known

    @staticmethod
    def _have_finished(configuration: Configuration, state: _State) -> bool:
        return bool(state.children) and all(configuration[child][1] & FINISHED for child in state.children)

    def _cycle(
        self, before: Configuration, position: int, transition: TransitionModel | None
    ) -> Configuration:
        locals_ = list(before)
        index, flags, waited = locals_[position]
        state = self._states[position][index]
        if flags & OWED:
            flags, waited = flags & ~OWED, 0
            locals_[position] = index, flags, waited
            self._wake_children(locals_, state)
        if transition is not None:
            for child in state.children:
                self._sleep(locals_, child)
            index = transition.target
            state = self._states[position][index]
            locals_[position] = index, flags, 0
            self._wake_children(locals_, state)
        if state.final:
            locals_[position] = index, locals_[position][1] | FINISHED, 0
        return tuple(locals_)

    def _wake_children(self, locals_: list[Local], state: _State) -> None:
        """Begin the automata below a state that was entered; finished ones and those of `restart` anew."""
        if state.final:
            return
        for child in state.children:
            flags = locals_[child][1]
            self._begin(locals_, child, anew=state.restart or not flags & BEGUN or bool(flags & FINISHED))

    def _begin(self, locals_: list[Local], position: int, *, anew: bool) -> None:
        if not anew:
            self._resume(locals_, position)
            return
        index = self._initial[position]
        state = self._states[position][index]
        locals_[position] = index, ACTIVE | BEGUN | (OWED if state.owes else 0), 0
        if not state.owes:
            self._wake_children(locals_, state)

    def _resume(self, locals_: list[Local], position: int) -> None:
        index, flags, waited = locals_[position]
        locals_[position] = index, flags | ACTIVE, waited
        state = self._states[position][index]
        if not flags & OWED and not state.final:
            for child in state.children:
                self._resume(locals_, child)

    def _sleep(self, locals_: list[Local], position: int) -> None:
        index, flags, waited = locals_[position]
        if flags & ACTIVE:
            locals_[position] = index, flags & ~ACTIVE, waited
            for child in self._states[position][index].children:
                self._sleep(locals_, child)

    def _next(self, configuration: Configuration, phase: int, after: int) -> tuple[Node, int]:
        """Return the next cycle behind that of `after` at `phase` in which anything can change."""
        best, chosen = -1, -1
        for position, (index, flags, waited) in enumerate(configuration):
            if flags & (ACTIVE | FINISHED) != ACTIVE:
                continue
            interval = self._intervals[position]
            wait = -phase % interval  # until its next cycle
            if wait == 0 and position <= after:
                wait = interval
            if 0 <= best <= wait:
                continue
            if not flags & OWED:
                state = self._states[position][index]
                missing = self._missing(configuration, state, waited)
                if missing < 0:
                    continue
                if missing > wait:
                    wait += -(-(missing - wait) // interval) * interval
            if best < 0 or wait < best:
                best, chosen = wait, position
        if chosen < 0:
            return Node(configuration, 0, -1), 0
        if best:
            configuration = self._advanced(configuration, best)
        return Node(configuration, (phase + best) % self.common, chosen), best

    def _missing(self, configuration: Configuration, state: _State, waited: int) -> int:
        """Return the active time until a transition can fire, 0 when one can, -1 when none ever can."""
        if state.final:
            return 0
        missing = -1
        for transition in state.outgoing:
            if transition.finished and not self._have_finished(configuration, state):
                continue
            if transition.delay <= waited:
                return 0
            left = transition.delay - waited
            if missing < 0 or left < missing:
                missing = left
        return missing

    def _advanced(self, configuration: Configuration, elapsed: int) -> Configuration:
        return tuple(
            (index, flags, min(waited + elapsed, clamp))
            if flags & (ACTIVE | FINISHED | OWED) == ACTIVE
            and waited < (clamp := self._states[position][index].clamp)
            else (index, flags, waited)
            for position, (index, flags, waited) in enumerate(configuration)
        )


def _choices(enabled: list[TransitionModel]) -> Iterator[Choice]:
    """Yield what a cycle may come to. No event comes but the one that fires: it would wait in the queue."""
    needs: list[Conjunction] = [transition.needs or () for transition in enabled]
    events = {transition.event: (transition.needs or ())[0][0] for transition in enabled if transition.event}
    for place, transition in enumerate(enabled):
        others = tuple((atom, False) for event, atom in events.items() if event != transition.event)
        values = satisfy(needs[place] + others, needs[:place])
        if values is not None:
            yield Choice(transition, frozenset(atom for atom, value in values.items() if value))
    values = satisfy(tuple((atom, False) for atom in events.values()), needs)
    if values is not None:
        yield Choice(None, frozenset(atom for atom, value in values.items() if value))
