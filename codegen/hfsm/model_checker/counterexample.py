"""Runs of automata as sequences of steps that a person reads and an editor plays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from .exploration import Move, Run
from .model import Model, TransitionModel
from .transition_system import ACTIVE, BEGUN, FINISHED, Configuration, TransitionSystem

__all__ = ["Counterexample", "Step", "StepKind", "counterexample"]

_NANO: Final = 1e6
_EVENT: Final = "event "


class StepKind(StrEnum):
    """What happens in a step."""

    EVENT = "event"
    """An event arrives in time for the cycle that follows."""
    GUARD = "guard"
    """A guard that is asked in the cycle holds; those that are not told do not."""
    FIRES = "fires"
    ENTERS = "enters"
    """An automaton begins, in its initial state."""
    GHOST = "ghost"
    RESUMES = "resumes"
    FINISHES = "finishes"


@dataclass(frozen=True, slots=True)
class Step:
    """One step, at `time_ms`. `automaton`, `transition`, `origin` and `state` are ids of the document.

    `origin` is the state before a transition and `state` the one after it, or else that of the automaton.
    """

    time_ms: float
    automaton: int
    kind: StepKind
    text: str
    state: int
    origin: int | None = None
    transition: int | None = None
    event: str = ""


@dataclass(frozen=True, slots=True)
class Counterexample:
    """The steps from the start until a property is violated, at `ends_ms`.

    Where it is violated because something never comes, the steps from the index `repeats` on may repeat for
    ever: the first round lasts from `repeats_ms` to `ends_ms`. When nothing need happen any more the index is
    their number, and both times are the same.
    """

    steps: tuple[Step, ...]
    ends_ms: float
    repeats: int | None = None
    repeats_ms: float | None = None

    def __str__(self) -> str:
        """Return the steps, one a line and numbered, with their times in seconds."""
        lines = [
            f"{number:3}. {step.time_ms / 1000:9.3f} s  {step.text}"
            for number, step in enumerate(self.steps, 1)
        ]
        if self.repeats is not None:
            again = f"from step {self.repeats + 1}" if self.repeats < len(self.steps) else "without a step"
            lines.append(f"{'':4} {self.ends_ms / 1000:9.3f} s  and so on {again}")
        return "\n".join(lines)


def counterexample(model: Model, system: TransitionSystem, run: Run) -> Counterexample:
    """Return a run as steps."""
    teller = _Teller(model, system)
    steps = list(teller.begins(run.start, 0))
    repeats: int | None = None
    for number, move in enumerate(run.moves):
        if number == run.repeats:
            repeats = len(steps)
        steps += teller.move(move)
    if run.repeats == len(run.moves):
        repeats = len(steps)
    begins = None
    if run.repeats is not None:
        begins = (run.moves[run.repeats].time if run.repeats < len(run.moves) else run.ends) / _NANO
    return Counterexample(tuple(steps), run.ends / _NANO, repeats, begins)


class _Teller:
    def __init__(self, model: Model, system: TransitionSystem) -> None:
        self._model = model
        self._system = system

    def move(self, move: Move) -> Iterator[Step]:
        """Yield what happens in one cycle."""
        node, time, fired = move.node, move.time / _NANO, move.choice.transition
        before, after, position = node.configuration, move.configuration, node.position
        index = self._system.cone[position]
        for atom in sorted(move.choice.true):
            if atom.startswith(_EVENT):
                name = atom.removeprefix(_EVENT)
                text = f"the event `{name}` arrives at {self._model.label(index)}"
                yield self._step(time, index, StepKind.EVENT, text, before[position][0], event=name)
        yield from self._guards(move, index, time)
        if fired is not None:
            origin = self._model.automata[index].states[fired.origin]
            for child in origin.children:
                yield from self._sleeps(before, child, time)
            yield self._fires(index, fired, time)
        woken = fired is not None or not self._children_active(before, index, after[position][0])
        if woken:
            owner = self._model.automata[index].states[after[position][0]]
            for child in owner.children:
                anew = owner.restart or self._begins(before, child)
                yield from self._wakes(before, after, child, time, anew=anew)
        if after[position][1] & FINISHED and not before[position][1] & FINISHED:
            text = f"{self._model.label(index)} has finished"
            yield self._step(time, index, StepKind.FINISHES, text, after[position][0])

    def begins(self, start: Configuration, index: int) -> Iterator[Step]:
        """Yield how the automata begin."""
        position = self._system.position.get(index)
        if position is None or not start[position][1] & ACTIVE:
            return
        state = start[position][0]
        text = f"`{self._model.state_path(index, state)}` is entered"
        yield self._step(0.0, index, StepKind.ENTERS, text, state)
        for child in self._model.automata[index].states[state].children:
            yield from self.begins(start, child)

    def _guards(self, move: Move, index: int, time: float) -> Iterator[Step]:
        true = move.choice.true
        for transition in self._system.enabled(move.node):
            asked = not transition.event or f"{_EVENT}{transition.event}" in true
            if (
                transition.guarded
                and asked
                and all((atom in true) is value for atom, value in transition.needs or ())
            ):
                text = f"the guard of {self._name(transition)} holds in {self._model.label(index)}"
                yield self._step(time, index, StepKind.GUARD, text, transition.origin, transition=transition)
            if transition is move.choice.transition:
                return

    def _fires(self, index: int, transition: TransitionModel, time: float) -> Step:
        origin = self._model.state_path(index, transition.origin)
        target = self._model.automata[index].states[transition.target].source.name
        text = f"`{origin}` -> `{target}` by {self._name(transition)}"
        return self._step(time, index, StepKind.FIRES, text, transition.target, transition=transition)

    def _children_active(self, configuration: Configuration, index: int, state: int) -> bool:
        positions = self._system.position
        children = self._model.automata[index].states[state].children
        return all(configuration[positions[child]][1] & ACTIVE for child in children if child in positions)

    def _begins(self, before: Configuration, index: int) -> bool:
        position = self._system.position.get(index)
        return position is None or not before[position][1] & BEGUN or bool(before[position][1] & FINISHED)

    def _sleeps(self, before: Configuration, index: int, time: float) -> Iterator[Step]:
        position = self._system.position.get(index)
        if position is None or not before[position][1] & ACTIVE:
            return
        state = before[position][0]
        for child in self._model.automata[index].states[state].children:
            yield from self._sleeps(before, child, time)
        text = f"`{self._model.state_path(index, state)}` becomes a ghost"
        yield self._step(time, index, StepKind.GHOST, text, state)

    def _wakes(
        self, before: Configuration, after: Configuration, index: int, time: float, *, anew: bool
    ) -> Iterator[Step]:
        position = self._system.position.get(index)
        if position is None or not after[position][1] & ACTIVE:
            return
        state = after[position][0]
        path = self._model.state_path(index, state)
        if anew:
            yield self._step(time, index, StepKind.ENTERS, f"`{path}` is entered", state)
        else:
            yield self._step(time, index, StepKind.RESUMES, f"`{path}` goes on", state)
        owner = self._model.automata[index].states[state]
        for child in owner.children:
            below = anew and (owner.restart or self._begins(before, child))
            yield from self._wakes(before, after, child, time, anew=below)

    def _name(self, transition: TransitionModel) -> str:
        source = transition.source
        return f"`{source.name}`" if source.name.strip() else f"transition {source.id}"

    def _step(
        self,
        time: float,
        index: int,
        kind: StepKind,
        text: str,
        state: int,
        *,
        transition: TransitionModel | None = None,
        event: str = "",
    ) -> Step:
        automaton = self._model.automata[index]
        return Step(
            time_ms=time,
            automaton=automaton.source.id,
            kind=kind,
            text=text,
            state=automaton.states[state].source.id,
            origin=None if transition is None else automaton.states[transition.origin].source.id,
            transition=None if transition is None else transition.source.id,
            event=event,
        )
