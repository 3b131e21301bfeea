"""The events of a run, kept for assertions and shown when one fails."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from .._automaton import Event, Transition
from ..errors import describe
from ..observer import Observer
from ..tree import Actor, ChangeKind, DropReason

_SECOND: Final = 1_000_000_000
_LONGEST_LINE: Final = 200  # characters


@dataclass(frozen=True, slots=True)
class Call:
    """A call of the behavior, at a time in s, and its outcome.

    `automaton` and `state` are the names of those that made it, empty for calls outside any cycle.
    """

    time: float
    target: str
    """Servant and operation, as in `Head.setPose`."""
    arguments: dict[str, Any]
    """The arguments by the names of the parameters."""
    result: Any
    error: Exception | None
    automaton: str
    state: str

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        """Return an argument: `call.pan` is `call.arguments["pan"]`."""
        if name.startswith("__"):  # copy and pickle look for these, even before there are arguments
            raise AttributeError(name)
        try:
            return self.arguments[name]
        except KeyError:
            known = ", ".join(self.arguments) or "none"
            raise AttributeError(f"{self.target} has no argument {name!r}; it has {known}") from None

    def __str__(self) -> str:
        arguments = ", ".join(f"{name}={_short(value)}" for name, value in self.arguments.items())
        outcome = f"raised {self.error!r}" if self.error else f"-> {_short(self.result)}"
        place = f"  [{self.automaton}/{self.state}]" if self.automaton else ""
        return f"{self.time:9.3f} s  {self.target}({arguments}) {outcome}{place}"


@dataclass(frozen=True, slots=True)
class Fired:
    """A transition that fired, at a time in s: its automaton, its name, its origin and its destination."""

    time: float
    automaton: str
    transition: str
    id: int
    origin: str
    destination: str


class Journal(Observer):
    """Write down the events and the calls of the automata of a run, all of them or the newest `kept`."""

    def __init__(self, now: Callable[[], float], kept: int | None = None) -> None:
        self._now = now
        self._calls: deque[Call] = deque(maxlen=kept)
        self._running: list[Actor] = []
        """The automata whose cycles run, the innermost last."""
        self._firing: Actor | None = None
        self.fired_transitions: deque[Fired] = deque(maxlen=kept)
        self._lines: deque[str] = deque(maxlen=kept)
        self._written = 0
        self._failures: deque[tuple[Actor, Exception]] = deque(maxlen=kept)

    def cycle_began(self, actor: Actor, at: int) -> None:  # noqa: ARG002
        """Note the automaton whose code runs."""
        self._running.append(actor)

    def cycle_ended(self, actor: Actor, at: int) -> None:  # noqa: ARG002
        """Note that its code does not run any more."""
        self._running.remove(actor)

    def fired(self, actor: Actor, transition: Transition, at: int) -> None:
        """Write down a transition."""
        automaton = actor.automaton
        destination = automaton.state(transition.destination).name
        time, origin = at / _SECOND, actor.current.name
        fired = Fired(time, automaton.name, transition.name, transition.id, origin, destination)
        self.fired_transitions.append(fired)
        self._firing = actor
        name = transition.name or f"transition {transition.id}"
        what = f"{automaton.name}: {origin} -> {destination}  by {name}{_why(transition)}"
        self._write(time, actor.depth, what)

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:
        """Write down a change that no transition of the automaton itself reported."""
        if kind is ChangeKind.ENTERED and self._firing is actor:
            self._firing = None  # `fired` has written it down
        else:
            self._write(
                now / _SECOND, actor.depth, f"{actor.automaton.name}: {_VERBS[kind]} {actor.current.name}"
            )

    def event_sent(self, event: Event, now: int) -> None:
        """Write down an event."""
        data = "" if event.data is None else f" with {event.data!r}"
        self._write(now / _SECOND, 0, f"event {event.name}{data}")

    def event_dropped(self, actor: Actor, event: Event, reason: DropReason) -> None:
        """Write down an event that fired nothing."""
        what = f"{actor.automaton.name}: drops event {event.name} in {actor.current.name}: {reason}"
        self._write(self._now(), actor.depth, what)

    def code_failed(self, actor: Actor, error: Exception) -> None:
        """Write down an exception of user code."""
        self._failures.append((actor, error))
        text = f"{actor.automaton.name}: in {actor.current.name} raises {describe(error)}"
        self._write(self._now(), actor.depth, text[:_LONGEST_LINE])

    def called(self, target: str, arguments: dict[str, Any], result: object, error: Exception | None) -> None:
        """Write down a call of the code that runs."""
        running = self._running[-1:]  # a call may come from another thread, while a cycle ends
        place = (running[0].automaton.name, running[0].current.name) if running else ("", "")
        self._calls.append(Call(self._now(), target, arguments, result, error, *place))

    def calls(self, target: str = "") -> list[Call]:
        """Return the calls of an operation (`Head.setPose`) or of a servant (`Head`), or all."""
        if not target:
            return list(self._calls)
        made = tuple(self._calls)  # which a paced execution may extend meanwhile
        return [call for call in made if target in (call.target, call.target.partition(".")[0])]

    def take_failures(self) -> list[tuple[Actor, Exception]]:
        """Return the exceptions of user code since the last time, with their automata."""
        taken = list(self._failures)
        self._failures.clear()
        return taken

    def note(self, text: str) -> None:
        """Write down what the test did."""
        self._write(self._now(), 0, f"the test {text}")

    def text(self, last: int = 60) -> str:
        """Return the timeline, its newest lines at the bottom."""
        lines = list(self._lines)[-last:]
        left_out = self._written - len(lines)
        return "\n".join([f"({left_out} lines before)", *lines] if left_out else lines)

    def _write(self, time: float, depth: int, text: str) -> None:
        self._written += 1
        self._lines.append(f"{time:10.3f} s  {'  ' * depth}{text}")


_VERBS: Final = {
    ChangeKind.ENTERED: "enters",
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


def _short(value: object) -> str:
    text = repr(value) if not isinstance(value, float) else f"{value:.4g}"
    return text if len(text) <= 60 else text[:57] + "..."
