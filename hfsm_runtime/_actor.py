"""An automaton while it runs: its current state, whether it is a ghost, its active time, its events.

Times are integer nanoseconds of component time, so that sums are exact.
"""

from __future__ import annotations

import math
import threading
from collections import OrderedDict, deque
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

from zenoh_ice.data.text import sentence

from ._automaton import REQUIRED, Automaton, Event, State, Transition
from ._phases import BEGUN, ENTERED, FINISHED, IDLE, OUTLIVED, SETTLED, UNUSED, CycleStatus, Phase
from .errors import DefinitionError, EventError

CAPACITY: Final = 64
"""Capacity of an automaton's event queue; beyond it the oldest are dropped."""
_DEEPEST_HISTORY: Final = 32


class ChangeKind(StrEnum):
    """A change of an automaton."""

    ENTERED = "entered"
    """It entered a state."""
    GHOST = "ghost"
    """An ancestor left the state above it: it remembers its own."""
    RESUMED = "resumed"
    """It resumes in the state that it remembered."""
    FINISHED = "finished"
    """It is in a final state, and runs no more cycles."""


class DropReason(StrEnum):
    """Why an event left the queue of an automaton without firing a transition."""

    UNHANDLED = sentence("no transition out of the current state used it")
    GHOST = sentence("the automaton became a ghost before its turn")
    FINISHED = sentence("the automaton has finished")
    OVERFLOW = sentence(f"more than {CAPACITY} events waited")


@dataclass(eq=False, repr=False, slots=True)
class EventQueue:
    """The events of an automaton."""

    waiting: deque[Event] = field(default_factory=deque)
    """The events to be handled, oldest first; at most `CAPACITY`."""
    due: int = 0
    """Their number when the running cycle began: it handles no others."""
    refusal: Event | None = None
    """The event `REFUSED`, which comes before those that wait."""
    tried: Event | None = None
    """The event with which the running cycle tries its transitions."""
    dropped: int = 0
    last_dropped: tuple[Event, DropReason, int] | None = None
    """The newest dropped event, the reason, and the component time."""

    def pop(self) -> Event:
        """Remove the oldest one."""
        if self.due:
            self.due -= 1
        return self.waiting.popleft()


@dataclass(eq=False, repr=False, slots=True)
class Outputs:
    """The outputs of an automaton."""

    latest: Mapping[str, object] = field(default_factory=dict)
    """The values at the end of the last finished cycle, or from the start."""
    handed: Mapping[str, object] | None = None
    """The values that the parent has last."""
    unset: bool = False
    """Set by a start: the next cycle first assigns the defaults."""


@dataclass(eq=False, repr=False, slots=True)
class CycleNotes:
    """The cycles of an automaton: the one that runs, when the next one comes, and how long they took."""

    status: CycleStatus = IDLE
    began: int | None = None
    """The time at which the running one really began, which may be later than the time it belongs to."""
    began_wall: float = 0.0
    """The same of the running or the last one, as `time.perf_counter()`."""
    last_slot: int = -1
    """The time to which the last completed one belongs."""
    next_slot: int = 0
    """The time of the next one whose transitions are not decided yet."""
    followers: OrderedDict[threading.Event, None] = field(default_factory=OrderedDict)
    """The events of the threads whose cycles come after that decision, in order."""
    count: int = 0
    overruns: int = 0
    last: float = 0.0
    """The duration of the last one in s of wall time."""
    longest: float = 0.0

    def release_followers(self) -> None:
        """Wake the first of the threads that follow, which wakes the next one; newer ones form a new queue.

        Many threads that woke at once would compete for the interpreter.
        """
        followers, self.followers = self.followers, OrderedDict()
        wake_next(followers)


@dataclass(eq=False, repr=False, slots=True)
class Actor:
    """An automaton at run time. Its fields change only through `Tree`, and under its lock."""

    # The structure.
    automaton: Automaton
    parent: Actor | None
    owner: State | None
    """The state of the parent that owns it."""
    children: dict[int, tuple[Actor, ...]] = field(default_factory=dict)
    """The automata below it, by the id of the state that owns them."""
    depth: int = field(init=False)
    """The number of automata above it."""

    # The place in it.
    current: State = field(init=False)
    """The state; before it has entered any, the one that it enters first."""
    below: tuple[Actor, ...] = ()
    """The automata that the current state owns."""
    phase: Phase = UNUSED
    active_since: int | None = None
    """The time since which all ancestors are in the states that own the chain to here; None for a ghost."""
    entered: int = 0
    """The time of the entry into the current state."""
    waited: int = 0
    """The active time in the current state up to `since`."""
    since: int | None = None
    """The time from which active time counts; None while it stands still."""
    last_transition: int = 0
    guards: dict[int, tuple[bool, int]] = field(default_factory=dict)
    """The last value of each guard out of the current state, and the time of its cycle."""

    # Requests of clients.
    forced: Transition | None = None
    """A transition that fires in the next cycle, whatever its guard says."""
    stepping: bool = False
    """A request for one cycle although the tree is held."""

    events: EventQueue = field(default_factory=EventQueue)
    outputs: Outputs = field(default_factory=Outputs)
    cycle: CycleNotes = field(default_factory=CycleNotes)

    def __post_init__(self) -> None:
        self.turn_to(self.automaton.initial)
        self.move_below(self.parent)

    def turn_to(self, state: State) -> None:
        """Let a state be the current one."""
        self.current = state
        self.below = self.children.get(state.id, ())

    def move_below(self, parent: Actor | None) -> None:
        """Let it be below another automaton."""
        self.parent = parent
        self.depth = 0 if parent is None else parent.depth + 1

    @property
    def active(self) -> bool:
        """Whether it is no ghost."""
        return self.active_since is not None

    @property
    def in_cycle(self) -> bool:
        """Whether a cycle of it runs."""
        return self.cycle.status is not IDLE

    @property
    def owed(self) -> bool:
        """Whether the entry code of the current state, or its arguments, have not run to their end yet."""
        return UNUSED < self.phase < ENTERED

    @property
    def finished(self) -> bool:
        """Whether it has reached a final state."""
        return self.phase is FINISHED

    @property
    def on_duty(self) -> bool:
        """Whether the running cycle is still to run code: not when it has outlived its activation."""
        return self.active_since is not None and self.cycle.status is not OUTLIVED

    @property
    def awake(self) -> bool:
        """Whether the automata below the current state are active."""
        return self.active_since is not None and self.phase >= BEGUN and not self.current.final

    @property
    def takes(self) -> bool:
        """Whether it takes outputs of the automata below the current state."""
        return self.current.results is not None

    @property
    def hands_up(self) -> bool:
        """Whether the automaton above takes its outputs."""
        return self.owner is not None and self.owner.results is not None and bool(self.automaton.outputs)

    @property
    def below_finished(self) -> bool:
        """Whether the automata of the current state have finished, and their last outputs have been taken."""
        below = self.below
        if not below or not all(child.finished for child in below):
            return False
        return not self.takes or all(child.outputs.handed is child.outputs.latest for child in below)

    def active_time(self, now: int) -> int:
        """Return the active time since the entry into the current state in ns."""
        since = self.since
        return self.waited if since is None or now < since else self.waited + now - since

    def may_change(self, now: int) -> bool:
        """Return whether a cycle at a time may change anything that others notice.

        Guards may hold, any event may arrive, and outputs are handed over.
        """
        if self.owed or self.current.final or self.takes or self.hands_up:
            return True
        return self.active_time(now) >= self.automaton.soonest(self.current)

    def rests(self, now: int) -> bool:
        """Return whether a cycle at a time does nothing: no code runs, no transition is tried."""
        state, events = self.current, self.events
        return (
            (self.phase is SETTLED or self.phase is BEGUN)
            and self.active_time(now) < self.automaton.exits[state.id].unsent
            and not (state.code or state.results or state.final or self.hands_up or self.outputs.unset)
            and not (events.waiting or events.refusal or self.forced)
        )

    def chain(self) -> Iterator[Actor]:
        """Yield this automaton and those above it, up to the root."""
        each: Actor | None = self
        while each is not None:
            yield each
            each = each.parent

    def descendants(self) -> Iterator[Actor]:
        """Yield all automata below this one."""
        for children in self.children.values():
            for child in children:
                yield child
                yield from child.descendants()

    def paths(self) -> Iterator[str]:
        """Yield the names of current states from here down, joined by `/`; one for each branch."""
        below = () if self.current.final else self.below
        if not below:
            yield self.current.name
        for child in below:
            for path in child.paths():
                yield f"{self.current.name}/{path}"


def wake_next(followers: OrderedDict[threading.Event, None]) -> None:
    """Wake the first of the threads in a queue, if any."""
    with suppress(KeyError):
        followers.popitem(last=False)[0].set()


def grow(root: Automaton) -> tuple[Actor, ...]:
    """Return the runs of the automata of a tree, each before its children. Raises DefinitionError."""
    actors = tuple(_grow(root, None, None))
    if len({actor.automaton.id for actor in actors}) != len(actors):
        raise DefinitionError("two automata have one id")
    for declared in root.inputs:
        if declared.default is REQUIRED:
            raise DefinitionError(f"nothing sets the input {declared.name!r} of the root: give it a default")
    return actors


def _grow(automaton: Automaton, parent: Actor | None, owner: State | None) -> Iterator[Actor]:
    actor = Actor(automaton, parent, owner)
    yield actor
    for state in automaton.states:
        below: list[Actor] = []
        for child in state.children:
            grown = list(_grow(child, actor, state))
            below.append(grown[0])
            yield from grown
        if below:
            actor.children[state.id] = tuple(below)
    actor.turn_to(actor.current)


def make_event(name: str, data: object = None) -> Event:
    """Return an event with a copy of its data; raises EventError when JSON cannot represent the data."""
    if not isinstance(name, str) or not name:
        raise EventError(f"an event has a name, which is text, not {name!r}")
    return Event(name, None if data is None else _copy(data, f"the data of the event {name!r}", 0))


def _copy(value: object, where: str, depth: int) -> Any:  # noqa: ANN401 - whatever JSON knows
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        if math.isfinite(value):
            return value
        raise EventError(f"{where} is {value}, which JSON cannot represent")
    if depth >= _DEEPEST_HISTORY:
        raise EventError(f"{where} is nested deeper than {_DEEPEST_HISTORY} levels")
    if isinstance(value, list | tuple):
        return [_copy(item, f"{where}[{index}]", depth + 1) for index, item in enumerate(value)]
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str):
                raise EventError(f"{where} has the key {key!r}: keys are text")
        return {key: _copy(item, f"{where}[{key!r}]", depth + 1) for key, item in value.items()}
    raise EventError(
        f"{where} is a {type(value).__name__}: it may be None, bool, int, float, str, lists, "
        "and dicts with text as keys"
    )
