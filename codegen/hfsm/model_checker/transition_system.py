"""Describe the exact behavior of several automata, cycle by cycle, for all values of their guards.

A node is a configuration and its next cycle: which automaton runs, and when. Cycles in which
nothing can change are skipped. Each run in virtual time is a path through these nodes, and each path is a run
for some values of the guards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from ...graphs import reached
from ...logic import Conjunction, satisfy
from ._fireability import Fireability
from .model import TransitionModel

ACTIVE: Final = 1
FINISHED: Final = 2
OWED: Final = 4
"""The entry into the current state has not run: its timers have not started, and its children sleep."""
BEGUN: Final = 8
"""It has been active."""
RUNNING: Final = ACTIVE | FINISHED
"""A running automaton has ACTIVE alone of these flags."""

Local = tuple[int, int, int]
"""One automaton: its state, its flags, and its active time in the state in ns, up to the longest timer."""

Configuration = tuple[Local, ...]
"""The automata of a cone, in the order of the model."""

Holds = Callable[[Configuration], bool]
"""A statement about a configuration."""


class StepKind(StrEnum):
    """The kind of a step of a run."""

    EVENT = "event"
    """An event arrives in time for the cycle that follows."""
    GUARD = "guard"
    """A guard that is evaluated in the cycle holds; those without such a step do not."""
    FIRES = "fires"
    ENTERS = "enters"
    """An automaton begins, in its initial state."""
    GHOST = "ghost"
    RESUMES = "resumes"
    FINISHES = "finishes"


class AutomatonChange(NamedTuple):
    """A change of the automaton at a position, which is then in this state."""

    kind: StepKind
    position: int
    state: int


class Choice(NamedTuple):
    """A possible outcome of a cycle: the transition that fires, or None, and the atoms that must be true."""

    transition: TransitionModel | None
    true: frozenset[str]


class Node(NamedTuple):
    """A configuration before the cycle of the automaton at `position`, -1 if nothing more can happen.

    `phase` is the time of the cycle modulo the common multiple of all periods.
    """

    configuration: Configuration
    phase: int
    position: int


class Move(NamedTuple):
    """The cycle of `node` at `time` ns, its outcome, the configuration after it, and the next node."""

    time: int
    node: Node
    choice: Choice
    configuration: Configuration
    following: Node
    elapsed: int
    """The time until the cycle of the next node, in ns."""
    during: tuple[Configuration, ...] = ()
    """The configurations before its end in which cycles of others come, if code is slow."""


@dataclass(frozen=True, slots=True)
class _State:
    final: bool
    owes: bool
    restart: bool
    children: tuple[int, ...]
    outgoing: tuple[TransitionModel, ...]
    clamp: int
    """The longest delay out of it: longer active times are equal."""


class TransitionSystem:
    """Some `automata`, as indices of a model, with all that influence them: the cone.

    Automata are influenced by those above them, and by those below a state that is left when these finish.
    An automaton `alone` is always active, and nothing below it finishes.
    """

    def __init__(self, automata: Iterable[int], fireability: Fireability, *, alone: bool = False) -> None:
        self.model = model = fireability.model
        self.cone = tuple(sorted(automata if alone else _cone_of(automata, fireability)))
        """The automata, each before its children."""
        self.position = {index: position for position, index in enumerate(self.cone)}
        """The position of each of them in a configuration."""
        self._intervals = tuple(model.automata[index].interval for index in self.cone)
        self._common = math.lcm(*self._intervals)
        self._initial = tuple(model.automata[index].initial for index in self.cone)
        self._states = tuple(self._read_states(index, fireability) for index in self.cone)
        self._resting: dict[tuple[int, int], bool] = {}
        self._choices: dict[tuple[int, int, tuple[int, ...]], tuple[Choice, ...]] = {}

    def _read_states(self, index: int, fireability: Fireability) -> tuple[_State, ...]:
        found = []
        for state in self.model.automata[index].states:
            outgoing = tuple(each for each in state.outgoing if fireability.may_fire(index, each))
            children = tuple(self.position[child] for child in state.children if child in self.position)
            clamp = max((each.delay for each in outgoing), default=0)
            found.append(_State(state.final, state.owes, state.restart, children, outgoing, clamp))
        return tuple(found)

    def start(self) -> tuple[Configuration, Node, int]:
        """Return the first configuration, the first node, and the time until its cycle in ns."""
        cycle = self._first_cycle()
        configuration = tuple(cycle.locals)
        node, elapsed = self._next(configuration, 0, -1)
        return configuration, node, elapsed

    def moves(self, node: Node, time: int) -> Iterator[Move]:
        """Yield every outcome of a cycle at `time` ns."""
        index, flags, _ = node.configuration[node.position]
        is_idle = not flags & OWED and not self._states[node.position][index].final
        for choice in self._choices_at(node):
            configuration, during = node.configuration, tuple[Configuration, ...]()
            if choice.transition is not None or not is_idle:
                cycle = self._cycle(node, choice)
                configuration = tuple(cycle.locals)
                during = tuple(cycle.during) if self.model.slow else ()
            following, elapsed = self._next(configuration, node.phase, node.position)
            yield Move(time, node, choice, configuration, following, elapsed, during)

    def changes(self, node: Node | None, choice: Choice | None) -> list[AutomatonChange]:
        """Return the changes in a cycle, in order; without a node, those at the start."""
        cycle = self._first_cycle() if node is None or choice is None else self._cycle(node, choice)
        return cycle.changes

    def may_rest(self, configuration: Configuration) -> bool:
        """Return whether nothing more has to change: every possible change waits for a guard."""
        for position, (index, flags, _) in enumerate(configuration):
            if flags & RUNNING == ACTIVE and (flags & OWED or not self._rests(position, index)):
                return False
        return True

    def _rests(self, position: int, index: int) -> bool:
        known = self._resting.get((position, index))
        if known is None:
            state = self._states[position][index]
            known = not state.final and satisfy((), refused_by(state.outgoing)) is not None
            self._resting[position, index] = known
        return known

    def enabled(self, node: Node) -> list[TransitionModel]:
        """Return the transitions whose guards are evaluated in the cycle, in order, if none of them holds."""
        index, flags, waited = node.configuration[node.position]
        state = self._states[node.position][index]
        if flags & OWED:
            waited = 0
        if state.final:
            return []
        finished = _have_finished(node.configuration, state) and not flags & OWED
        return [
            transition
            for transition in state.outgoing
            if transition.delay <= waited and (finished or not transition.finished)
        ]

    def _choices_at(self, node: Node) -> tuple[Choice, ...]:
        enabled = self.enabled(node)
        key = node.position, node.configuration[node.position][0], tuple([t.index for t in enabled])
        known = self._choices.get(key)
        if known is None:
            known = self._choices[key] = tuple(_choices(enabled))
        return known

    def _first_cycle(self) -> _Cycle:
        cycle = _Cycle(self._states, self._initial, [(initial, 0, 0) for initial in self._initial])
        cycle.begin(0)
        return cycle

    def _cycle(self, node: Node, choice: Choice) -> _Cycle:
        """Return the cycle of a node after it has run."""
        cycle = _Cycle(self._states, self._initial, list(node.configuration))
        cycle.run(node.position, choice.transition)
        return cycle

    def _next(self, configuration: Configuration, phase: int, after: int) -> tuple[Node, int]:
        """Return the next cycle after that of position `after` at `phase` in which something can change."""
        best, chosen = -1, -1
        for position, (index, flags, waited) in enumerate(configuration):
            if flags & RUNNING != ACTIVE:
                continue
            interval = self._intervals[position]
            wait = -phase % interval  # until its next cycle
            if wait == 0 and position <= after:
                wait = interval
            if 0 <= best <= wait:
                continue
            if not flags & OWED:
                missing = _missing(configuration, self._states[position][index], waited)
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
        return Node(configuration, (phase + best) % self._common, chosen), best

    def _advanced(self, configuration: Configuration, elapsed: int) -> Configuration:
        locals_ = list(configuration)
        for position, (index, flags, waited) in enumerate(configuration):
            if flags & (RUNNING | OWED) == ACTIVE:
                clamp = self._states[position][index].clamp
                if waited < clamp:
                    locals_[position] = index, flags, min(waited + elapsed, clamp)
        return tuple(locals_)


def _cone_of(automata: Iterable[int], fireability: Fireability) -> Iterable[int]:
    def needed(index: int) -> Iterator[int]:
        automaton = fireability.model.automata[index]
        if automaton.parent >= 0:
            yield automaton.parent
        for transition in automaton.transitions:
            if transition.finished and fireability.may_fire(index, transition):
                yield from automaton.states[transition.origin].children

    return reached(automata, needed)


class _Cycle:
    """The automata while a cycle changes them as the runtime does, and the `changes`.

    `during` are the configurations while exit code runs, and while code of the transition and entry code do.
    """

    __slots__ = ("_initial", "_states", "changes", "during", "locals")

    def __init__(
        self, states: tuple[tuple[_State, ...], ...], initial: tuple[int, ...], locals_: list[Local]
    ) -> None:
        self.locals = locals_
        self.changes: list[AutomatonChange] = []
        self.during: list[Configuration] = []
        self._states = states
        self._initial = initial

    def run(self, position: int, transition: TransitionModel | None) -> None:
        """Run the cycle of one automaton, in which a transition fires or none."""
        index, flags, waited = self.locals[position]
        state = self._states[position][index]
        if flags & OWED:
            flags, waited = flags & ~OWED, 0
            self.locals[position] = index, flags, waited
            self._wake_children(state)
        if transition is not None:
            for child in state.children:
                self._sleep(child)
            self.during.append(tuple(self.locals))
            index = transition.target
            self.changes.append(AutomatonChange(StepKind.FIRES, position, index))
            state = self._states[position][index]
            self.locals[position] = index, flags, 0
            self.during.append(tuple(self.locals))
            self._wake_children(state)
        if state.final:
            self.locals[position] = index, flags | FINISHED, 0
            if not flags & FINISHED:
                self.changes.append(AutomatonChange(StepKind.FINISHES, position, index))

    def begin(self, position: int) -> None:
        """Begin an automaton in its initial state."""
        index = self._initial[position]
        state = self._states[position][index]
        self.locals[position] = index, ACTIVE | BEGUN | (OWED if state.owes else 0), 0
        self.changes.append(AutomatonChange(StepKind.ENTERS, position, index))
        if not state.owes:
            self._wake_children(state)

    def _wake_children(self, state: _State) -> None:
        """Wake the automata below a state that was entered; with `restart`, or when finished, they begin."""
        if state.final:
            return
        for child in state.children:
            flags = self.locals[child][1]
            if state.restart or flags & (BEGUN | FINISHED) != BEGUN:
                self.begin(child)
            else:
                self._resume(child)

    def _resume(self, position: int) -> None:
        index, flags, waited = self.locals[position]
        self.locals[position] = index, flags | ACTIVE, waited
        self.changes.append(AutomatonChange(StepKind.RESUMES, position, index))
        state = self._states[position][index]
        if not flags & OWED and not state.final:
            for child in state.children:
                self._resume(child)

    def _sleep(self, position: int) -> None:
        index, flags, waited = self.locals[position]
        if flags & ACTIVE:
            for child in self._states[position][index].children:
                self._sleep(child)
            self.locals[position] = index, flags & ~ACTIVE, waited
            self.changes.append(AutomatonChange(StepKind.GHOST, position, index))


def _have_finished(configuration: Configuration, state: _State) -> bool:
    return bool(state.children) and all(configuration[child][1] & FINISHED for child in state.children)


def _missing(configuration: Configuration, state: _State, waited: int) -> int:
    """Return the active time until a transition can fire: 0 if one can now, -1 if none ever can."""
    if state.final:
        return 0
    missing = -1
    for transition in state.outgoing:
        if transition.finished and not _have_finished(configuration, state):
            continue
        if transition.delay <= waited:
            return 0
        left = transition.delay - waited
        if missing < 0 or left < missing:
            missing = left
    return missing


def refused_by(transitions: Iterable[TransitionModel]) -> Iterator[Conjunction]:
    """Yield what has to be false if none of some transitions fires."""
    for transition in transitions:
        yield transition.needs or ()
        yield from transition.links


def _choices(enabled: list[TransitionModel]) -> Iterator[Choice]:
    """Yield the possible outcomes of a cycle. Only the event that fires arrives: others wait in the queue."""
    needs: list[Conjunction] = [transition.needs or () for transition in enabled]
    linked = [link for transition in enabled for link in transition.links]
    events = {transition.event: (transition.needs or ())[0][0] for transition in enabled if transition.event}
    for place, transition in enumerate([*enabled, None]):
        wanted = () if transition is None else needs[place]
        fired = "" if transition is None else transition.event
        others = tuple((atom, False) for event, atom in events.items() if event != fired)
        values = satisfy(wanted + others, needs[:place] + linked)
        if values is not None:
            yield Choice(transition, frozenset(atom for atom, value in values.items() if value))
