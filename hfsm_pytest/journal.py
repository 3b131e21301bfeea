"""What happened in a run, kept for assertions and shown when one fails."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from hfsm_runtime import Event, Transition
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import ChangeKind, Run

from .calls import CallLog

__all__ = ["Entry", "Fired", "Journal"]

_SECOND: Final = 1_000_000_000
_LONGEST: Final = 200


@dataclass(frozen=True, slots=True)
class Fired:
    """A transition that fired, at a time in s: its automaton, its name, and the states that it joins."""

    time: float
    automaton: str
    transition: str
    id: int
    origin: str
    destination: str


@dataclass(frozen=True, slots=True)
class Entry:
    """A line of the timeline; `depth` is that of the automaton in the tree."""

    time: float
    depth: int
    text: str


class Journal(Observer):
    """Write down what the automata of a run do, and tell the log of calls who makes them."""

    def __init__(self, calls: CallLog, now: Callable[[], float]) -> None:
        self._calls = calls
        self._now = now
        self._stack: list[Run | None] = []
        self._firing: Run | None = None
        self.fired_transitions: list[Fired] = []
        self.entries: list[Entry] = []
        self.failures: list[tuple[Run, Exception]] = []
        """The exceptions of user code, with their automata."""

    def begin(self, runs: Sequence[Run]) -> None:
        """Write down where the automata are before the first cycle."""
        for run in runs:
            if run.active:
                self.changed(0, run, ChangeKind.ENTERED)

    def cycle_began(self, run: Run, at: int) -> None:  # noqa: ARG002
        """Note whose code runs."""
        self._stack.append(self._calls.run)
        self._calls.run = run

    def cycle_ended(self, run: Run, at: int) -> None:  # noqa: ARG002
        """Note that its code runs no longer."""
        self._calls.run = self._stack.pop() if self._stack else None

    def fired(self, run: Run, transition: Transition, at: int) -> None:
        """Write down a transition."""
        automaton = run.automaton
        destination = automaton.state(transition.destination).name
        fired = Fired(
            at / _SECOND, automaton.name, transition.name, transition.id, run.current.name, destination
        )
        self.fired_transitions.append(fired)
        self._firing = run
        name = transition.name or f"transition {transition.id}"
        self._write(at, run, f"{fired.origin} -> {destination}  by {name}{_why(transition)}")

    def changed(self, now: int, run: Run, kind: ChangeKind) -> None:
        """Write down a change that no transition of the automaton itself told of."""
        if kind is ChangeKind.ENTERED:
            if self._firing is run:
                self._firing = None  # `fired` has written it down
            else:
                self._write(now, run, f"enters {run.current.name}")
        else:
            self._write(now, run, f"{_VERBS[kind]} {run.current.name}")

    def event_sent(self, event: Event, now: int) -> None:
        """Write down an event."""
        data = "" if event.data is None else f" with {event.data!r}"
        self.entries.append(Entry(now / _SECOND, 0, f"event {event.name}{data}"))

    def code_failed(self, run: Run, error: Exception) -> None:
        """Write down an exception of user code."""
        self.failures.append((run, error))
        text = f"{run.automaton.name}: in {run.current.name} raises {type(error).__name__}: {error}"
        self.entries.append(Entry(self._now(), run.depth, text[:_LONGEST]))

    def note(self, text: str) -> None:
        """Write down what the test did."""
        self.entries.append(Entry(self._now(), 0, f"the test {text}"))

    def text(self, last: int = 60) -> str:
        """Return the timeline, its newest lines at the bottom."""
        shown = self.entries[-last:]
        lines = [f"{entry.time:10.3f} s  {'  ' * entry.depth}{entry.text}" for entry in shown]
        left_out = len(self.entries) - len(shown)
        return "\n".join([f"({left_out} lines before)"] * (left_out > 0) + lines)

    def _write(self, now: int, run: Run, text: str) -> None:
        self.entries.append(Entry(now / _SECOND, run.depth, f"{run.automaton.name}: {text}"))


_VERBS: Final = {
    ChangeKind.GHOST: "becomes a ghost in",
    ChangeKind.RESUMED: "resumes",
    ChangeKind.FINISHED: "finishes in",
}


def _why(transition: Transition) -> str:
    if transition.seconds is not None:
        return f" after {transition.seconds:g} s"
    if transition.event:
        return f" at event {transition.event}"
    return f" when {transition.condition}" if transition.condition else ""
