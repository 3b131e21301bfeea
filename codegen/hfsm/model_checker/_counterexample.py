"""Write runs of automata as steps for people to read and for the editor to play."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from ...messages import Message, joined
from ._exploration import Run
from .model import EVENT, TransitionModel, condition_of
from .transition_system import AutomatonChange, Move, StepKind, TransitionSystem

_NANO: Final = 1e6
_LONGEST_GUARD: Final = 60


@dataclass(frozen=True, slots=True)
class CounterexampleStep:
    """One step, at `time_ms`. `automaton`, `transition`, `origin` and `state` are ids of the document.

    `origin` is the state before a transition. `state` is the one after it, or the current state.
    """

    time_ms: float
    automaton: int
    kind: StepKind
    text: Message
    state: int
    origin: int | None = None
    transition: int | None = None
    event: str = ""


@dataclass(frozen=True, slots=True)
class Counterexample:
    """The steps from the start until a property is violated, at `ends_ms`.

    If it is violated because something never happens, the steps from the index `repeats` may repeat forever:
    the first round lasts from `repeats_ms` to `ends_ms`. If nothing more has to happen, `repeats` is the
    number of steps, and both times are equal. It is a run only if the `guards` ever hold, of which the model
    checker knows no values.
    """

    steps: tuple[CounterexampleStep, ...]
    ends_ms: float
    repeats: int | None = None
    repeats_ms: float | None = None
    guards: tuple[str, ...] = ()

    def __str__(self) -> str:
        return str(self.text)

    @property
    def text(self) -> Message:
        """The steps, numbered, one per line, with their times in seconds."""
        return joined("\n", self._lines())

    def shortened(self, most: int) -> Message:
        """Return the text with `most` lines of its beginning and of its end."""
        lines = self._lines()
        left = len(lines) - 2 * most
        if left <= 0:
            return joined("\n", lines)
        return joined(
            "\n",
            [
                *lines[:most],
                Message("{indent}... {left} more ...", indent=" " * 18, left=left),
                *lines[-most:],
            ],
        )

    def _lines(self) -> list[Message]:
        lines = [
            Message(
                "{number:3}. {time:9.3f} s  {step}", number=number, time=step.time_ms / 1000, step=step.text
            )
            for number, step in enumerate(self.steps, 1)
        ]
        if self.repeats is not None:
            time = f"{'':4} {self.ends_ms / 1000:9.3f} s"
            if self.repeats < len(self.steps):
                lines.append(Message("{time}  and so on from step {step}", time=time, step=self.repeats + 1))
            else:
                lines.append(Message("{time}  and so on without a step", time=time))
        return lines


def counterexample(run: Run) -> Counterexample:
    """Return the steps of a run."""
    narrator = _Narrator(run.system)
    steps = list(narrator.begins())
    repeats: int | None = None
    for number, move in enumerate(run.moves):
        if number == run.repeats:
            repeats = len(steps)
        steps += narrator.move(move)
    if run.repeats == len(run.moves):
        repeats = len(steps)
    begins = None
    if run.repeats is not None:
        begins = (run.moves[run.repeats].time if run.repeats < len(run.moves) else run.ends) / _NANO
    return Counterexample(tuple(steps), run.ends / _NANO, repeats, begins, tuple(narrator.guards))


class _Narrator:
    """Describe the moves of a system by the names in its document; `guards` collects those that hold."""

    def __init__(self, system: TransitionSystem) -> None:
        self.guards: dict[str, None] = {}
        self._model = system.model
        self._system = system

    def begins(self) -> Iterator[CounterexampleStep]:
        """Yield the steps in which the automata begin."""
        for change in self._system.changes(None, None):
            yield self._changed(change, 0.0)

    def move(self, move: Move) -> Iterator[CounterexampleStep]:
        """Yield the steps of one cycle."""
        node = move.node
        time = move.time / _NANO
        fired = move.choice.transition
        label = self._model.label(self._system.cone[node.position])
        state = node.configuration[node.position][0]
        for atom in sorted(move.choice.true):
            if atom.startswith(EVENT):
                name = atom.removeprefix(EVENT)
                arrives = AutomatonChange(StepKind.EVENT, node.position, state)
                text = Message("the event `{name}` arrives at {automaton}", name=name, automaton=label)
                yield self._step(time, arrives, text, event=name)
        for transition in self._holding(move):
            holds = AutomatonChange(StepKind.GUARD, node.position, state)
            text = Message(
                "the guard of {transition} holds in {automaton}",
                transition=_name(transition),
                automaton=label,
            )
            if not transition.always:
                self.guards[" ".join(condition_of(transition.source).text.split())[:_LONGEST_GUARD]] = None
            yield self._step(time, holds, text, transition)
        for change in self._system.changes(node, move.choice):
            yield self._changed(change, time, fired if change.kind is StepKind.FIRES else None)

    def _holding(self, move: Move) -> Iterator[TransitionModel]:
        """Yield the transitions whose guards are evaluated in a cycle and hold."""
        true = move.choice.true
        for transition in self._system.enabled(move.node):
            evaluated = transition.guarded and (not transition.event or f"{EVENT}{transition.event}" in true)
            if evaluated and all((atom in true) is value for atom, value in transition.needs or ()):
                yield transition
            if transition is move.choice.transition:
                return

    def _changed(
        self, change: AutomatonChange, time: float, fired: TransitionModel | None = None
    ) -> CounterexampleStep:
        index = self._system.cone[change.position]
        return self._step(time, change, self._said(index, change, fired), fired)

    def _said(self, index: int, change: AutomatonChange, fired: TransitionModel | None) -> Message:
        if fired is not None:
            return Message(
                "`{origin}` -> `{target}` by {transition}",
                origin=self._model.state_path(index, fired.origin),
                target=self._model.automata[index].states[fired.target].source.name,
                transition=_name(fired),
            )
        path = self._model.state_path(index, change.state)
        match change.kind:
            case StepKind.ENTERS:
                return Message("`{path}` is entered", path=path)
            case StepKind.GHOST:
                return Message("`{path}` becomes a ghost", path=path)
            case StepKind.RESUMES:
                return Message("`{path}` resumes", path=path)
            case StepKind.FINISHES:
                return Message("{automaton} has finished", automaton=self._model.label(index))
        raise AssertionError(f"a change {change.kind} is described by its event, guard or transition")

    def _step(
        self,
        time: float,
        change: AutomatonChange,
        text: Message,
        transition: TransitionModel | None = None,
        event: str = "",
    ) -> CounterexampleStep:
        automaton = self._model.automata[self._system.cone[change.position]]
        return CounterexampleStep(
            time_ms=time,
            automaton=automaton.source.id,
            kind=change.kind,
            text=text,
            state=automaton.states[change.state].source.id,
            origin=None if transition is None else transition.source.origin,
            transition=None if transition is None else transition.source.id,
            event=event,
        )


def _name(transition: TransitionModel) -> Message:
    source = transition.source
    if source.name.strip():
        return Message.verbatim(f"`{source.name}`")
    return Message("transition {id}", id=source.id)
