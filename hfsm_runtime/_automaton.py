"""The structure of automata, as a generated component returns it: nothing in it changes at run time."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple, Never

import msgspec

from .errors import DefinitionError
from .places import text_of_guard

REQUIRED: Final = object()
"""The default of an input without a default value."""

REFUSED: Final = "refused"
"""The event that a state hears when a servant refuses what its code asks for; its data is why, in words."""

_BY_PLACE: Final = -1
"""The id of a state or a transition whose place in the automaton becomes its id."""

Arguments = Mapping[str, object] | Mapping[int, Mapping[str, object]]
"""Values of inputs or outputs by name; for several automata, by the automaton's id and then by name."""


class Event(msgspec.Struct, frozen=True):
    """A named message to every active automaton, with optional `data`.

    Data is a JSON value: None, bool, int, float, str, lists, and dicts with str keys.
    """

    name: str
    data: Any = None


class Input(msgspec.Struct, frozen=True, kw_only=True):
    """A variable of an automaton that the state above it sets: of type int, float, bool, str or object.

    If the default is `REQUIRED`, the state has to pass a value.
    """

    name: str
    type: type = object
    default: object = REQUIRED


class Output(msgspec.Struct, frozen=True, kw_only=True):
    """A variable of an automaton that the state above it may take: of type int, float, bool, str or object.

    It has the default from when the automaton starts until its code assigns it.
    """

    name: str
    type: type = object
    default: object = None


@dataclass(frozen=True)
class State:
    """A state: `code` runs once a cycle while it is the current one; it may own automata, its children.

    Its `id` is by default its place in the automaton, from 1. `entry` runs when the state is entered and
    `exit` when it is left. After the entry `arguments` returns the values for the inputs of the children: by
    input name for an only child, otherwise by child id and then by input name. `results` takes the outputs of
    the children, in the same form, into variables of the automaton: at the entry, and at the beginning of
    each cycle. With `restart` the children start again each time the state is entered, instead of resuming.
    An automaton in a `final` state has finished.
    """

    name: str
    _: KW_ONLY
    id: int = _BY_PLACE
    initial: bool = False
    final: bool = False
    entry: Callable[[], object] | None = None
    code: Callable[[], object] | None = None
    exit: Callable[[], object] | None = None
    children: tuple[Automaton, ...] = ()
    restart: bool = False
    arguments: Callable[[], Arguments] | None = None
    results: Callable[[Arguments], object] | None = None

    @cached_property
    def exit_runs(self) -> bool:
        """Whether exit code may run when it is left, its own or that of automata that start again."""
        below = (state for child in self.children for state in child.states if self.restart)
        return self.exit is not None or any(state.exit_runs for state in below)


class _End:
    """An end of a transition: given as a state or its id, read as the id."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, transition: Transition | None, owner: type) -> int:
        if transition is None:
            raise AttributeError(self._name)  # so that the dataclass sees a field without a default
        state: State | int = vars(transition)[self._name]
        return state if isinstance(state, int) else state.id

    def __set__(self, transition: Transition, state: State | int) -> None:
        vars(transition)[self._name] = state


@dataclass(frozen=True)
class Transition:
    """A transition from the state `origin` to the state `destination`.

    Its `id` is by default its place in the automaton, from 1. It fires `seconds` of active time after the
    entry into its origin, at the `event` of that name, when the origin's children have `finished`, or else
    when `guard` returns a true value. In the first three cases a `guard`, if given, must hold as well.
    `condition` is its text, by default the one in the component. `code` runs after the change of state.
    Guard and code of a transition with an event take the `Event`.
    """

    name: str
    origin: _End = _End()
    destination: _End = _End()
    _: KW_ONLY
    id: int = _BY_PLACE
    seconds: float | None = None
    event: str = ""
    finished: bool = False
    guard: Callable[..., object] | None = None
    condition: str = ""
    priority: int | None = None
    code: Callable[..., object] | None = None

    def __post_init__(self) -> None:
        if self.guard is not None and not self.condition:
            object.__setattr__(self, "condition", text_of_guard(self.guard))

    @cached_property
    def delay(self) -> int | None:
        """The time in ns after which it fires, or None."""
        return None if self.seconds is None else round(self.seconds * 1e9)


class Exits(NamedTuple):
    """The transitions out of a state, and what they wait for."""

    transitions: tuple[Transition, ...]
    """In the order in which they are tried."""
    events: frozenset[str]
    soonest: float
    """The active time in ns from which one can fire, or infinity."""
    unsent: float
    """The same while no event arrives."""


@dataclass(frozen=True)
class Automaton:
    """An automaton; its `id` is unique in the component. Raises DefinitionError.

    `period` is the time between its cycles in s. `set_inputs` takes a value for each of `inputs`, by name;
    `set_outputs` does the same for `outputs`, and `get_outputs` returns their values.
    Transitions out of a state are tried by priority, 1 first, then those without a priority in their order.
    `source` names the file from which it was imported.
    """

    name: str
    _: KW_ONLY
    id: int
    period: float = 0.1
    states: tuple[State, ...]
    transitions: tuple[Transition, ...] = ()
    inputs: tuple[Input, ...] = ()
    set_inputs: Callable[[Mapping[str, object]], object] | None = None
    outputs: tuple[Output, ...] = ()
    set_outputs: Callable[[Mapping[str, object]], object] | None = None
    get_outputs: Callable[[], Mapping[str, object]] | None = None
    source: str = ""

    def __post_init__(self) -> None:
        _number(self.states)
        _number(self.transitions)
        self._check()

    @cached_property
    def _by_id(self) -> dict[int, State]:
        return {state.id: state for state in self.states}

    @cached_property
    def exits(self) -> dict[int, Exits]:
        """What leads out of each state, by its id."""
        leaving: dict[int, list[Transition]] = {origin: [] for origin in self._by_id}
        for each in sorted(self.transitions, key=lambda t: math.inf if t.priority is None else t.priority):
            leaving[each.origin].append(each)
        return {origin: _exits(found) for origin, found in leaving.items()}

    @cached_property
    def initial(self) -> State:
        """The state in which it starts."""
        return next(state for state in self.states if state.initial)

    @cached_property
    def events(self) -> frozenset[str]:
        """The names of the events that any of its transitions waits for."""
        return frozenset(transition.event for transition in self.transitions if transition.event)

    @cached_property
    def interval(self) -> int:
        """The time between its cycles in ns."""
        return round(self.period * 1e9)

    def state(self, id: int) -> State:
        """Return the state with this id; raises KeyError."""
        return self._by_id[id]

    def outgoing(self, state: State) -> tuple[Transition, ...]:
        """Return the transitions out of a state, in the order in which they are tried."""
        return self.exits[state.id].transitions

    def soonest(self, state: State) -> float:
        """Return the active time in ns from which a transition out of a state can fire, or infinity."""
        return self.exits[state.id].soonest

    def first_outputs(self) -> dict[str, object]:
        """Return the outputs as they are when the automaton starts; each call copies their defaults."""
        return {each.name: copy.deepcopy(each.default) for each in self.outputs}

    def tree(self) -> Iterator[Automaton]:
        """Yield this automaton and all below it, each before its children."""
        yield self
        for state in self.states:
            for child in state.children:
                yield from child.tree()

    def _check(self) -> None:
        by_id = self._by_id
        if len(by_id) != len(self.states):
            self._refuse("has two states with one id")
        if sum(state.initial for state in self.states) != 1:
            self._refuse("needs exactly one initial state")
        if not _positive(self.period):
            self._refuse(f"has the period {self.period}: it is a positive number of seconds")
        if self.outputs and (self.get_outputs is None or self.set_outputs is None):
            self._refuse("has outputs, and needs `get_outputs` and `set_outputs`")
        for state in self.states:
            below = state.children if state.arguments is None else ()
            if below and any(given.default is REQUIRED for child in below for given in child.inputs):
                self._refuse("passes no inputs to its automata", f"the state {state.name!r} of ")
        for transition in self.transitions:
            if why := _misfit(transition, by_id):
                self._refuse(why, f"transition {transition.id} ({transition.name!r}) of ")

    def _refuse(self, why: str, part: str = "") -> Never:
        raise DefinitionError(f"{part}automaton {self.id} ({self.name!r}) {why}")


def _misfit(transition: Transition, states: Mapping[int, State]) -> str:
    """Return why a transition cannot be one between these states, or nothing."""
    if transition.origin not in states or transition.destination not in states:
        return "joins states that do not exist"
    triggers = (transition.seconds is not None) + bool(transition.event) + transition.finished
    if triggers > 1:
        return "fires by one of a time, an event and the end of the children"
    if not triggers and transition.guard is None:
        return "needs a time, an event or a guard"
    if transition.seconds is not None and not _positive(transition.seconds):
        return f"fires after {transition.seconds} s: it is a positive number"
    return ""


def _exits(leaving: list[Transition]) -> Exits:
    delays = [(each.delay or 0, each.event) for each in leaving]
    return Exits(
        tuple(leaving),
        frozenset(each.event for each in leaving if each.event),
        min((delay for delay, _ in delays), default=math.inf),
        min((delay for delay, event in delays if not event), default=math.inf),
    )


def _number(items: Sequence[State | Transition]) -> None:
    """Give each item without an id its place."""
    for place, item in enumerate(items, 1):
        if item.id == _BY_PLACE:
            object.__setattr__(item, "id", place)


def _positive(seconds: float) -> bool:
    return math.isfinite(seconds) and round(seconds * 1e9) >= 1
