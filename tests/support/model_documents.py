"""Documents for the model checker, also random ones, and the runtime that plays them.

A document becomes automata of the real runtime whose guards return what a script wants.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache
from hashlib import blake2b
from itertools import count
from pathlib import Path
from types import CodeType
from typing import Any, NamedTuple

from hypothesis import strategies as st

import hfsm_runtime as runtime
from codegen.hfsm.document import Automaton, Document, Event, Property, State, Text, Transition
from codegen.hfsm.model_checker import (
    Counterexample,
    ModelReport,
    PropertyResult,
    Reachability,
    StepKind,
    check_model,
    relied_on,
)
from codegen.hfsm.model_checker.expressions import parse
from codegen.hfsm.model_checker.model import Model, nanoseconds, read_model
from codegen.hfsm.model_checker.transition_system import ACTIVE, FINISHED, Configuration
from codegen.logic import PROOFS
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from tests.support.automata import component

__all__ = [
    "Player",
    "Script",
    "ScriptedDocument",
    "after",
    "automaton",
    "blink",
    "chain",
    "document",
    "documents",
    "finished",
    "impossible",
    "on",
    "play",
    "state",
    "stated",
    "verdicts",
    "when",
]

PATH = Path("model.xml")

Guard = Callable[[int, int, Transition], bool]
"""Takes the time in ns, the id of the automaton, and the transition."""


def state(id: int, name: str = "", *, children: Iterable[int] = (), entry: str = "", **others: Any) -> State:
    """Return a state, named after its id by default; `code` and `exit` may be strings."""
    texts: dict[str, Any] = {
        key: Text(others.pop(key)) for key in ("code", "exit", "history") if key in others
    }
    return State(id=id, name=name or f"s{id}", children=tuple(children), entry=Text(entry), **texts, **others)


def after(ms: float, origin: int, destination: int, guard: str = "", **others: Any) -> Transition:
    """Return a timed transition."""
    return _transition("time", f"{ms:g}", origin, destination, guard=guard, others=others)


def when(guard: str, origin: int, destination: int, **others: Any) -> Transition:
    """Return a transition with a guard."""
    return _transition("condition", guard, origin, destination, guard="", others=others)


def on(event: str, origin: int, destination: int, guard: str = "", **others: Any) -> Transition:
    """Return a transition that waits for an event."""
    return _transition("event", event, origin, destination, guard=guard, others=others)


def finished(origin: int, destination: int, guard: str = "", **others: Any) -> Transition:
    """Return a transition that fires when the children have finished."""
    return _transition("finished", "", origin, destination, guard=guard, others=others)


_numbers = count(1)


def _transition(
    kind: str, trigger: str, origin: int, destination: int, *, guard: str, others: dict[str, Any]
) -> Transition:
    priority = str(others.pop("priority", ""))
    code = str(others.pop("code", ""))
    number = others.pop("id", None) or next(_numbers)
    return Transition(
        id=number,
        origin=origin,
        destination=destination,
        type=kind,
        trigger=Text(trigger),
        guard=Text(guard),
        priority=Text(priority),
        code=Text(code),
        **others,
    )


def automaton(
    id: int,
    states: Iterable[State],
    transitions: Iterable[Transition] = (),
    *,
    father: int = 0,
    period: float = 100,
    **others: Any,
) -> Automaton:
    """Return an automaton whose first state is the initial one."""
    first, *rest = states
    return Automaton(
        id=id,
        father=father,
        states=(replace(first, initial=True), *rest),
        transitions=tuple(transitions),
        iteration_time=Text(f"{period:g}"),
        **others,
    )


def document(*automata: Automaton, properties: Iterable[Property] = (), **others: Any) -> Document:
    """Return a document."""
    return Document(automata=automata, properties=tuple(properties), **others)


def stated(kind: str, expression: str, within: str = "", name: str = "") -> Property:
    """Return a property."""
    return Property(name=name, kind=kind, expression=Text(expression), within=Text(within))


GUARDS = ("a", "b", "a", "b", "not a", "a and b", "a or b", "not (a or b)", "not (a and b)", "True", "False")
EVENTS = ("go", "halt")


@cache
def _one_of(*values: Any) -> st.SearchStrategy[Any]:
    """Return a strategy, the same for the same values: Hypothesis examines each of them once."""
    return st.sampled_from(values)


@cache
def _up_to(most: int, least: int = 0) -> st.SearchStrategy[int]:
    return st.integers(least, most)


class _Drawing:
    """Draws the automata of a document, from the top down."""

    def __init__(self, draw: st.DrawFn) -> None:
        self._draw = draw
        timers = ["time"] * draw(_one_of(0, 3, 3, 3))
        self._kinds = [*timers, "condition", "condition", "event"]
        self.automata: list[Automaton] = []

    def automaton(self, father: int, depth: int) -> int:
        """Draw an automaton with all automata below it; return its id."""
        place = len(self.automata)
        number = place + 1
        self.automata.append(Automaton(id=number))
        size = self._draw(_one_of(1, 2, 2, 3, 3))
        states = [self._state(number, each, depth) for each in range(1, size + 1)]
        wanted = self._draw(_up_to(size + 3, least=size - 1))
        transitions = [self._leaving(each, states) for each in range(1, wanted + 1)]
        period = self._draw(_one_of(50, 100, 100, 100, 130))
        self.automata[place] = automaton(number, states, transitions, father=father, period=period)
        return number

    def _state(self, automaton: int, number: int, depth: int) -> State:
        final = number > 1 and self._draw(_up_to(3)) == 0
        most = 2 if depth < 2 and len(self.automata) < 5 and not final else 0
        below = self._draw(_up_to(most))
        return state(
            number,
            children=[self.automaton(automaton, depth + 1) for _ in range(below)],
            entry=self._draw(_one_of("", "", "", "pass")),
            history=self._draw(_one_of("", "", "restart")),
            final=final,
        )

    def _leaving(self, number: int, states: list[State]) -> Transition:
        origin = states[(number - 1) % len(states)]
        kind = self._draw(_one_of(*self._kinds, *(["finished"] * 4 if origin.children else [])))
        trigger = ""
        if kind == "time":
            trigger = str(self._draw(_one_of(1, 70, 100, 150, 200, 260, 300, 500, 800)))
        elif kind != "finished":
            trigger = self._draw(_one_of(*(GUARDS if kind == "condition" else EVENTS)))
        guard = "" if kind == "condition" else self._draw(_one_of("", "", "", *GUARDS))
        destination = self._draw(_up_to(len(states), least=1))
        priority = self._draw(_one_of("", "", "1", "2"))
        others = {"id": number, "priority": priority}
        return _transition(kind, trigger, origin.id, destination, guard=guard, others=others)


@st.composite
def documents(draw: st.DrawFn) -> Document:
    """Draw a small document with all features of the language."""
    drawing = _Drawing(draw)
    drawing.automaton(0, 0)
    outside = draw(_one_of((), ("go",), EVENTS, EVENTS))
    return document(*drawing.automata, events=tuple(Event(name=name) for name in outside))


class Fired(NamedTuple):
    """A fired transition with its time in ns; both ids."""

    time: int
    automaton: int
    transition: int


@cache
def _compiled(guard: str) -> CodeType:
    return compile(guard, "<guard>", "eval")


class Script:
    """Random guards, which are the same for the same text in one cycle, and random events."""

    def __init__(self, document: Document, seed: int) -> None:
        self._seed = seed
        self._sent = [event.name for event in document.events]

    def guard(self, time: int, automaton: int, transition: Transition) -> bool:
        """Return the value of a guard."""
        text = transition.trigger.text if transition.type == "condition" else transition.guard.text
        event = transition.trigger.text if transition.type == "event" else ""
        values = {name: self._chance(time, automaton, event, name) for name in ("a", "b")}
        return bool(eval(_compiled(text), values))

    def events(self, time: int, automaton: int) -> list[str]:
        """Return events in any order, some of them twice: what fires nothing at once waits, or is dropped."""
        found = [
            name for name in self._sent for again in range(2) if self._chance(time, automaton, name, again)
        ]
        if len(found) > 1:
            random.Random(repr((self._seed, time, automaton))).shuffle(found)
        return found

    def _chance(self, *what: object) -> bool:
        drawn = blake2b(repr((self._seed, *what)).encode(), digest_size=4).digest()
        return int.from_bytes(drawn, "big") < 0.3 * 2**32


class ScriptedDocument(Observer):
    """A document as automata of the runtime, whose guards and events a script decides.

    `guard` returns the values of guards, and `present` the events that arrive just before a cycle.
    """

    def __init__(
        self, document: Document, guard: Guard, present: Callable[[int, int], Iterable[str]] = lambda *_: ()
    ) -> None:
        self.model: Model = read_model(document, PATH)
        self._guard = guard
        self._present = present
        self._now: dict[int, int] = {}
        """The time of the running cycle of each automaton."""
        self.root = self._build(self.model.automata[0].index)
        self.component = component(self.root)
        vars(self.component)[PROOFS] = relied_on(self.model.effects)[0]

    def cycle_began(self, run: Actor, at: int) -> None:
        self._now[run.automaton.id] = at
        run.events.waiting.extend(runtime.Event(name) for name in self._present(at, run.automaton.id))
        run.events.due = len(run.events.waiting)

    def _build(self, index: int) -> runtime.Automaton:
        model = self.model.automata[index]
        source = model.source
        return runtime.Automaton(
            id=source.id,
            name=str(source.id),
            period=(nanoseconds(source.iteration_time) or 0) / 1e9,
            states=tuple(
                runtime.State(
                    id=item.source.id,
                    name=item.source.name,
                    initial=item.index == model.initial,
                    final=item.final,
                    entry=(lambda: None) if item.owes else None,
                    restart=item.restart,
                    children=tuple(self._build(child) for child in item.children),
                )
                for item in model.states
            ),
            transitions=tuple(self._built(source.id, item.source) for item in model.transitions),
        )

    def _built(self, automaton: int, source: Transition) -> runtime.Transition:
        def guard(*_event: object) -> bool:
            return self._guard(self._now[automaton], automaton, source)

        guarded = source.type == "condition" or not source.guard.is_blank
        return runtime.Transition(
            source.name,
            source.origin,
            source.destination,
            id=source.id,
            seconds=float(source.trigger.text) / 1000 if source.type == "time" else None,
            event=source.trigger.text if source.type == "event" else "",
            finished=source.type == "finished",
            guard=guard if guarded else None,
            priority=int(source.priority.text) if source.priority.text else None,
        )


class Player(ScriptedDocument):
    """A document in virtual time, and its record."""

    def __init__(
        self, document: Document, guard: Guard, present: Callable[[int, int], Iterable[str]] = lambda *_: ()
    ) -> None:
        super().__init__(document, guard, present)
        self.fired_: list[Fired] = []
        self.seen: list[tuple[int, Configuration]] = []
        self.virtual = runtime.VirtualRun(self.component)
        self._runs = [
            (run, {item.source.id: item.index for item in model.states})
            for model in self.model.automata
            if (run := self.virtual.tree.actor(model.source.id)) is not None
        ]
        """The automata in the order of the model, and the indices of their states by id."""
        self.virtual.tree.observers.append(self)
        self.seen.append((0, self._configuration()))

    def cycle_ended(self, run: Actor, at: int) -> None:
        self.seen.append((at, self._configuration()))

    def fired(self, run: Actor, transition: runtime.Transition, at: int) -> None:
        self.fired_.append(Fired(at, run.automaton.id, transition.id))

    @property
    def visited(self) -> set[tuple[int, int]]:
        """The active automata and their states at the ends of cycles, by ids."""
        return {
            (model.source.id, model.states[index].source.id)
            for _, configuration in self.seen
            for model, (index, flags, _) in zip(self.model.automata, configuration, strict=True)
            if flags & ACTIVE
        }

    def times(self, expression: str) -> list[int]:
        """Return the times in ns after whose cycles an expression held."""
        parsed = parse(expression, self.model)
        holds = parsed.bind({automaton.index: automaton.index for automaton in self.model.automata})
        return [time for time, configuration in self.seen if holds(configuration)]

    def _configuration(self) -> Configuration:
        return tuple(
            (indices[run.current.id], (ACTIVE if run.active else 0) | (FINISHED if run.finished else 0), 0)
            for run, indices in self._runs
        )


def impossible(report: ModelReport) -> tuple[set[tuple[int, int]], set[tuple[int, int]]]:
    """Return the states and the transitions that a report calls impossible, each by ids."""
    states = {(s.automaton, s.state) for s in report.states if s.reachability is Reachability.IMPOSSIBLE}
    transitions = {
        (t.automaton, t.transition) for t in report.transitions if t.reachability is Reachability.IMPOSSIBLE
    }
    return states, transitions


def play(document: Document, example: Counterexample, rounds: int = 3) -> Player:
    """Play a counterexample on the runtime; its repeating part is played several times."""
    guards: set[tuple[int, int, int]] = set()
    events: dict[tuple[int, int], set[str]] = {}
    end = round(example.ends_ms * 1e6)
    loop = len(example.steps) if example.repeats is None else example.repeats
    period = 0 if example.repeats_ms is None else end - round(example.repeats_ms * 1e6)
    for number, step in enumerate(example.steps):
        for turn in range(rounds + 1 if number >= loop else 1):  # the last one begins as the run ends
            time = round(step.time_ms * 1e6) + turn * period
            if step.kind is StepKind.GUARD and step.transition is not None:
                guards.add((time, step.automaton, step.transition))
            if step.kind is StepKind.EVENT:
                events.setdefault((time, step.automaton), set()).add(step.event)
    player = Player(
        document,
        lambda time, automaton, transition: (time, automaton, transition.id) in guards,
        lambda time, automaton: events.get((time, automaton), ()),
    )
    if example.repeats is not None and not period:
        period = 5_000_000_000  # nothing has to happen any more
    player.virtual.advance((end + (rounds - 1) * period) / 1e9)
    return player


def blink(*more: Transition) -> Document:
    """Return a document that goes on and off by timers, with more transitions."""
    return document(
        automaton(
            1,
            [state(1, "off"), state(2, "on"), state(3, "broken")],
            [after(300, 1, 2, id=1), after(200, 2, 1, id=2), *more],
        )
    )


def chain(depth: int) -> Document:
    """Return automata one below the other, each with a loop of ten states."""
    automata = []
    for number in range(1, depth + 1):
        states = [
            state(each, children=[number + 1] if each == 7 and number < depth else ())
            for each in range(1, 11)
        ]
        transitions = [when(f"g{each}", each, each % 10 + 1) for each in range(1, 11)]
        automata.append(automaton(number, states, transitions, father=number - 1))
    return document(*automata)


def verdicts(doc: Document, *properties: Property, limit: int = 300_000) -> list[PropertyResult]:
    """Return what the model checker finds of properties of a document."""
    return list(check_model(replace(doc, properties=properties), PATH, limit=limit).properties)
