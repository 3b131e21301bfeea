"""The events of a run, kept for assertions and shown when one fails."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import msgspec

from .._automaton import Automaton, Event, State, Transition
from ..coroutine import current_coroutine
from ..errors import describe
from ..observer import Observer
from ..tree import Actor, ChangeKind, DropReason

_Firing = tuple[float, Automaton, State, Transition]
"""A transition that fired at a time in s, and its origin; a `Fired` when somebody looks."""
_SECOND: Final = 1_000_000_000
_LONGEST_LINE: Final = 200  # characters
_LARGE: Final = 1 << 16
"""Bytes of a result from which it is large, such as a picture."""
_LARGE_KEPT: Final = 32 << 20
"""Bytes of all large results that are kept: those of a minute of two cameras would be 280 MB."""


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
    """Of pictures, and other results of 64 kB and more, those of the newest 32 MB; None before."""
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


class Fired(msgspec.Struct, frozen=True):
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
        self._large: deque[tuple[Call, int]] = deque()
        """The calls whose large results are kept, with their sizes."""
        self._large_size = 0
        self._firing: Actor | None = None
        self._fired: deque[_Firing] = deque(maxlen=kept)
        self._lines: deque[tuple[float, int, Callable[..., str], tuple[object, ...]]] = deque(maxlen=kept)
        """The time in s, the depth of the automaton, and a function that returns the text of these parts.

        Nobody reads most of them.
        """
        self._written = 0
        self._failures: deque[tuple[Actor, Exception]] = deque(maxlen=kept)

    def fired(self, actor: Actor, transition: Transition, at: int) -> None:
        """Write down a transition."""
        firing = at / _SECOND, actor.automaton, actor.current, transition
        self._fired.append(firing)
        self._firing = actor
        self._write(firing[0], actor.depth, _firing, firing)

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:
        """Write down a change that no transition of the automaton itself reported."""
        if kind is ChangeKind.ENTERED and self._firing is actor:
            self._firing = None  # `fired` has written it down
        else:
            self._write(now / _SECOND, actor.depth, _change, actor.automaton, kind, actor.current)

    def event_sent(self, event: Event, now: int) -> None:
        """Write down an event."""
        data = "" if event.data is None else f" with {event.data!r}"
        self._write(now / _SECOND, 0, "event {}{}".format, event.name, data)

    def event_dropped(self, actor: Actor, event: Event, reason: DropReason) -> None:
        """Write down an event that fired nothing."""
        drops = "{}: drops event {} in {}: {}".format
        self._write(
            self._now(), actor.depth, drops, actor.automaton.name, event.name, actor.current.name, reason
        )

    def code_failed(self, actor: Actor, error: Exception) -> None:
        """Write down an exception of user code."""
        self._failures.append((actor, error))
        text = f"{actor.automaton.name}: in {actor.current.name} raises {describe(error)}"
        self._write(self._now(), actor.depth, str, text[:_LONGEST_LINE])

    def called(
        self,
        target: str,
        arguments: dict[str, Any],
        result: object,
        error: Exception | None,
        size: int = 0,
    ) -> None:
        """Write down a call of the code that runs here; `size` is that of its encoded result."""
        code = current_coroutine()
        actor: Actor | None = None if code is None else code.actor
        place = ("", "") if actor is None else (actor.automaton.name, actor.current.name)
        call = Call(self._now(), target, arguments, result, error, *place)
        self._calls.append(call)
        if size >= _LARGE:
            self._large.append((call, size))
            self._large_size += size
            while self._large_size > _LARGE_KEPT:
                oldest, freed = self._large.popleft()
                object.__setattr__(oldest, "result", None)  # frozen for everybody else
                self._large_size -= freed

    @property
    def fired_transitions(self) -> list[Fired]:
        """The transitions that fired."""
        made = tuple(self._fired)  # which a paced execution may extend meanwhile
        return [_fired(*each) for each in made]

    def calls(self, target: str = "") -> list[Call]:
        """Return the calls of an operation (`Head.setPose`) or of a servant (`Head`), or all."""
        if not target:
            return list(self._calls)
        made = tuple(self._calls)  # which a paced execution may extend meanwhile
        return [call for call in made if target in (call.target, call.target.partition(".")[0])]

    def take_failures(self) -> list[tuple[Actor, Exception]]:
        """Return the exceptions of user code since the last time, with their automata."""
        if not self._failures:
            return []
        taken = list(self._failures)
        self._failures.clear()
        return taken

    def note(self, text: str) -> None:
        """Write down what the test did."""
        self._write(self._now(), 0, "the test {}".format, text)

    def text(self, last: int = 60) -> str:
        """Return the timeline, its newest lines at the bottom."""
        lines = [
            f"{time:10.3f} s  {'  ' * depth}{text(*parts)}"
            for time, depth, text, parts in list(self._lines)[-last:]
        ]
        left_out = self._written - len(lines)
        return "\n".join([f"({left_out} lines before)", *lines] if left_out else lines)

    def _write(self, time: float, depth: int, text: Callable[..., str], *parts: object) -> None:
        self._written += 1
        self._lines.append((time, depth, text, parts))


_VERBS: Final = {
    ChangeKind.ENTERED: "enters",
    ChangeKind.GHOST: "becomes a ghost in",
    ChangeKind.RESUMED: "resumes",
    ChangeKind.FINISHED: "finishes in",
}


def _fired(time: float, automaton: Automaton, origin: State, transition: Transition) -> Fired:
    destination = automaton.state(transition.destination).name
    return Fired(time, automaton.name, transition.name, transition.id, origin.name, destination)


def _firing(firing: _Firing) -> str:
    fired, transition = _fired(*firing), firing[-1]
    name = fired.transition or f"transition {fired.id}"
    return f"{fired.automaton}: {fired.origin} -> {fired.destination}  by {name}{_why(transition)}"


def _change(automaton: Automaton, kind: ChangeKind, state: State) -> str:
    return f"{automaton.name}: {_VERBS[kind]} {state.name}"


def _why(transition: Transition) -> str:
    if transition.seconds is not None:
        return f" after {transition.seconds:g} s"
    if transition.event:
        return f" at event {transition.event}"
    return f" when {transition.condition}" if transition.condition else ""


def _short(value: object) -> str:
    text = repr(value) if not isinstance(value, float) else f"{value:.4g}"
    return text if len(text) <= 60 else text[:57] + "..."
