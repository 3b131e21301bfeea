"""Read the model of a document: states, triggers and times, without the code."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Final

from ...diagnostics import Location, Note
from ...logic import Conjunction
from ...messages import Message
from .._definitions import Answer
from .._effects import CodeEffects
from ..analysis import analyze
from ..code._values import delay as transition_time
from ..code._values import milliseconds, truth
from ..code.language import is_foreign
from ..document import DEFAULT_PERIOD, REFUSED, Automaton, Document, State, Text, Transition
from ._guards import Definition, conjunction, definitions, never

_DEEPEST_TREE: Final = 200

EVENT: Final = "the event "
"""The beginning of the atom of an event: like other atoms here, it is no Python, as guards are."""


@dataclass(frozen=True, slots=True)
class TransitionModel:
    """A transition. `index` is its place in the automaton, `origin` and `target` are indices of states.

    It fires after `delay` ns of active time, when the children have `finished` (if it waits for them) and
    every atom of `needs` has its value; an event is `EVENT` with its name. `needs` is None if it never holds.
    """

    index: int
    source: Transition
    origin: int
    target: int
    delay: int = 0
    event: str = ""
    finished: bool = False
    needs: Conjunction | None = ()
    guarded: bool = False
    always: bool = False
    """True if its guard, if it has one, is a constant that is true."""
    definitions: tuple[Definition, ...] = ()
    """Those of the atoms of its guard that consist of others."""

    @property
    def atoms(self) -> list[str]:
        """The atoms of its guard, if it has one, and those of which they consist: each as often as it is."""
        parts = (literal for _, literals in self.definitions for literal in literals)
        return [atom for atom, _ in (*(self.needs or ()), *parts)] if self.guarded else []

    @property
    def links(self) -> list[Conjunction]:
        """What no values of its atoms make true."""
        return [each for definition in self.definitions for each in never(definition)]


@dataclass(frozen=True, slots=True)
class StateModel:
    """A state. `children` are indices of automata; `outgoing` is in the order of evaluation.

    A state `owes` an entry if it has entry code or arguments, which come before its children wake.
    """

    index: int
    source: State
    final: bool
    owes: bool
    restart: bool
    children: tuple[int, ...]
    outgoing: tuple[TransitionModel, ...]


@dataclass(frozen=True, slots=True)
class AutomatonModel:
    """An automaton. `parent` is the index of the one above, -1 for the root; the `interval` is in ns."""

    index: int
    source: Automaton
    parent: int
    owner: int
    interval: int
    initial: int
    states: tuple[StateModel, ...]
    transitions: tuple[TransitionModel, ...]


@dataclass(frozen=True)
class Model:
    """The automata of a document that can run, each before its children."""

    document: Document
    path: Path
    automata: tuple[AutomatonModel, ...]
    effects: CodeEffects = field(repr=False, compare=False)
    doubtful: tuple[Note, ...] = ()
    """Guards that may differ from others of the same text."""
    slow: bool = False
    """Whether a cycle may last, so that others come before its end."""
    ends: bool = False
    """Whether code may end the component."""

    @cached_property
    def by_id(self) -> dict[int, AutomatonModel]:
        """The automata by the ids of the document."""
        return {automaton.source.id: automaton for automaton in self.automata}

    def ancestors(self, index: int) -> Iterator[tuple[AutomatonModel, StateModel]]:
        """Yield the automata above one, nearest first, each with the state that owns the chain down to it."""
        automaton = self.automata[index]
        while automaton.parent >= 0:
            parent = self.automata[automaton.parent]
            yield parent, parent.states[automaton.owner]
            automaton = parent

    def state_path(self, automaton: int, state: int) -> str:
        """Return the names of the states from the root down to one: `followBall/green`."""
        names = [self.automata[automaton].states[state].source.name]
        names += [owner.source.name for _, owner in self.ancestors(automaton)]
        return "/".join(reversed(names))

    def label(self, automaton: int) -> Message:
        """Return the name of an automaton in messages: `the root automaton`, or by the state that owns it."""
        model = self.automata[automaton]
        if model.parent < 0:
            return Message("the root automaton")
        path = self.state_path(model.parent, model.owner)
        if len(self.automata[model.parent].states[model.owner].children) > 1:
            return Message("the automaton below `{path}` with the id {id}", path=path, id=model.source.id)
        return Message("the automaton below `{path}`", path=path)


def read_model(
    document: Document,
    path: Path,
    *,
    effects: CodeEffects | None = None,
    trusting: bool = False,
    untimed: bool = False,
) -> Model:
    """Return the model of a document; structural errors are read as generation reads them.

    The first initial state counts, or the first state if there is none. Missing children, transitions between
    missing states, and automata without a root above them are left out.

    Guards of the same text that cannot be followed may differ within one cycle. A `trusting` model considers
    them the same unless they certainly differ. In an `untimed` model any cycle may be missed, and a timer may
    expire in any cycle. `effects` are those of its code, if they are known already.
    """
    effects = effects or CodeEffects(analyze(document, path))
    reader = _Reader(effects, trusting=trusting, untimed=untimed)
    return Model(document, path, tuple(reader.automata), effects, tuple(reader.doubtful))


class _Reader:
    def __init__(self, effects: CodeEffects, *, trusting: bool, untimed: bool) -> None:
        document = effects.analysis.document
        self._effects = effects
        self._analysis = effects.analysis
        self._trusting = trusting
        self._untimed = untimed
        self._python = not is_foreign(document)
        self._hears_refusals = any(
            each.type == "event" and each.trigger.text.strip() == REFUSED
            for automaton in document.automata
            for each in automaton.transitions
        )
        self.doubtful: list[Note] = []
        self._sources: dict[int, Automaton] = {}
        for source in document.automata:
            self._sources.setdefault(source.id, source)
        self._seen: set[int] = set()
        self._found: list[AutomatonModel | None] = []
        roots = [source for source in document.automata if source.father == 0]
        if roots:
            self._read(roots[0], -1, -1, 0)
        self.automata = [automaton for automaton in self._found if automaton is not None]

    def _read(self, source: Automaton, parent: int, owner: int, depth: int) -> int:
        """Read an automaton and all below it; return its index."""
        index = len(self._found)
        self._seen.add(source.id)
        self._found.append(None)
        first: dict[int, int] = {}
        for number, state in enumerate(source.states):
            first.setdefault(state.id, number)
        transitions = {
            id(item): self._transition(number, item, first)
            for number, item in enumerate(source.transitions)
            if item.origin in first and item.destination in first
        }
        outgoing: dict[int, tuple[TransitionModel, ...]] = {}
        for leaving, items in source.all_outgoing().items():
            known = [transitions[id(item)] for item in items if id(item) in transitions]
            outgoing[leaving] = tuple(self._separated(known))
        states = []
        for number, state in enumerate(source.states):
            found = [self._sources.get(child) for child in dict.fromkeys(state.children)]
            below = [
                child for child in found if child is not None and child.states and child.id not in self._seen
            ]
            children = [
                self._read(child, index, number, depth + 1) for child in below if depth < _DEEPEST_TREE
            ]
            arguments = bool(state.arguments) and not state.final
            states.append(
                StateModel(
                    index=number,
                    source=state,
                    final=state.final,
                    owes=not state.entry.is_blank or arguments,
                    restart=state.history.text.strip().lower() == "restart",
                    children=tuple(children),
                    outgoing=outgoing.get(state.id, ()),
                )
            )
        initial = next((number for number, state in enumerate(source.states) if state.initial), 0)
        interval = nanoseconds(source.iteration_time) or nanoseconds(Text(DEFAULT_PERIOD)) or 1
        self._found[index] = AutomatonModel(
            index,
            source,
            parent,
            owner,
            interval,
            initial,
            tuple(states),
            tuple(each for of_one in outgoing.values() for each in of_one),
        )
        return index

    def _transition(self, number: int, source: Transition, states: Mapping[int, int]) -> TransitionModel:
        is_timed = source.type == "time" and transition_time(source.trigger) is not None
        return TransitionModel(
            index=number,
            source=source,
            origin=states[source.origin],
            target=states[source.destination],
            delay=(nanoseconds(source.trigger) or 1) if is_timed and not self._untimed else 0,  # 0: at once
            event=source.trigger.text.strip() if source.type == "event" else "",
            finished=source.type == "finished",
            needs=self._needs(number, source),
            guarded=not condition_of(source).is_blank,
            always=self._is_constant(condition_of(source)),
            definitions=tuple(self._definitions(source)),
        )

    def _definitions(self, source: Transition) -> Iterator[Definition]:
        piece = self._analysis.piece(condition_of(source)) if self._python else None
        if piece is not None and piece.expression is not None and truth(piece.expression) is None:
            for literal, parts in definitions(piece.expression, self._effects.is_total):
                yield _of_event((literal,), source)[0], _of_event(parts, source)

    def _is_constant(self, guard: Text) -> bool:
        piece = self._analysis.piece(guard)
        return piece is not None and piece.expression is not None and truth(piece.expression) is not None

    def _needs(self, number: int, source: Transition, *, is_steady: bool = True) -> Conjunction | None:
        """Return the conjunction of a transition without its time and children.

        Without times, it needs a cycle that is not missed and, if it is timed, one in which the timer has
        expired.
        """
        needs = self._conditions(number, source, is_steady=is_steady)
        if needs is None or not self._untimed:
            return needs
        expired: Conjunction = ((f"timer {number} has expired", True),) if source.type == "time" else ()
        return (*needs, ("the cycle is not missed", True), *expired)

    def _conditions(self, number: int, source: Transition, *, is_steady: bool) -> Conjunction | None:
        event = source.trigger.text.strip() if source.type == "event" else ""
        if source.type == "time" and transition_time(source.trigger) is None:
            return None
        if source.type == "event" and not event:
            return None
        arrives: Conjunction = ((f"{EVENT}{event}", True),) if event else ()
        guard = condition_of(source)
        if guard.is_blank and source.type != "condition":
            return arrives
        text = guard.text.strip()
        unique = f"transition {number}: {text}"
        holds: Conjunction | None = ((text or unique, True),)
        if self._python and text:
            piece = self._analysis.piece(guard)
            tree = None if piece is None else piece.expression
            holds = conjunction(tree, text, unique, is_steady=is_steady, total=self._effects.is_total)
            if holds == () and self._hears_refusals and self._effects.of(guard).answer is not Answer.SAME:
                holds = ((unique, True),)  # a state hears what a servant refuses: the guard fails then
        if holds is None or not event:
            return holds
        return (*arrives, *_of_event(holds, source))

    def _separated(self, outgoing: list[TransitionModel]) -> Iterator[TransitionModel]:
        """Yield the transitions out of a state: guards that may differ from others get separate atoms."""
        atoms = Counter(atom for model in outgoing for atom in model.atoms)
        for model in outgoing:
            if model.event:
                del atoms[f"{EVENT}{model.event}"]
        is_entangled = any(count > 1 for count in atoms.values()) or any(
            model.guarded and model.needs is None for model in outgoing
        )
        if not self._python or not is_entangled:
            yield from outgoing
            return
        answers = [self._effects.of(condition_of(model.source)).answer for model in outgoing]
        is_changing = any(Answer.CHANGES in answer for answer in answers)
        for model, answer in zip(outgoing, answers, strict=True):
            is_other, is_unsure = Answer.OTHER in answer, is_changing or Answer.UNKNOWN in answer
            if model.guarded and is_unsure and not is_other:
                text = condition_of(model.source)
                path = model.source.path or self._analysis.path
                place = Location(path, text.line or model.source.line, max(1, text.column))
                self.doubtful.append(
                    Note(Message("this guard may give another answer when it is evaluated again"), place)
                )
            if model.guarded and (is_other or (is_unsure and not self._trusting)):
                needs = self._needs(model.index, model.source, is_steady=False)
                yield replace(model, needs=needs, definitions=())
            else:
                yield model


def _of_event(literals: Conjunction, source: Transition) -> Conjunction:
    """Return the atoms of a guard as those of an event, if it waits for one: they may differ for each."""
    if source.type != "event":
        return literals
    return tuple((f"at {EVENT}{source.trigger.text.strip()!r}: {atom}", value) for atom, value in literals)


def condition_of(transition: Transition) -> Text:
    """Return the condition or the guard of a transition."""
    return transition.trigger if transition.type == "condition" else transition.guard


def nanoseconds(text: Text) -> int | None:
    """Return a text of milliseconds in ns, or None if it is not a positive time."""
    value = milliseconds(text)
    # through seconds, as the generator writes them
    return None if value is None else round(value / 1000 * 1e9)
