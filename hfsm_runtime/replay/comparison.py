"""Compare what a replay does with what was recorded, automaton by automaton, and say where they part."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import msgspec

from ..recording.messages import (
    Change,
    Cycle,
    EventSent,
    Failure,
    Firing,
    Guard,
    Message,
    Timers,
    Variables,
)
from .reader import Record

__all__ = ["Comparison", "Difference", "Divergence", "Side", "Step"]

_SECOND: Final = 1e9
_ACTS: Final = (Change, Firing, Failure, EventSent)
_MOST_DIFFERENCES: Final = 200


class Side(msgspec.Struct, frozen=True):
    """What one of the two did in the cycle in which they part."""

    state: str
    guards: dict[str, bool]
    fired: list[str]
    errors: list[str]
    state_after: str
    ran: bool
    """Whether it had that cycle at all."""


class Divergence(msgspec.Struct, frozen=True):
    """An automaton that does something else, in the cycle of a component time in s."""

    time: float
    automaton: int
    name: str
    recorded: Side
    replayed: Side


class Difference(msgspec.Struct, frozen=True):
    """A guard or a variable that has another value after a cycle, at first; a missing one has none."""

    time: float
    automaton: int
    name: str
    kind: Literal["guard", "variable"]
    what: str
    recorded: Any = None
    replayed: Any = None


class Step(msgspec.Struct, frozen=True):
    """An automaton enters a state, becomes a ghost, goes on, or finishes, at a component time in s."""

    time: float
    automaton: int
    name: str
    state: str
    kind: str


@dataclass
class _Frame:
    """One cycle of one automaton."""

    state: str
    guards: dict[str, bool] = field(default_factory=dict)
    fired: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    variables: dict[str, Any] = field(default_factory=dict)
    state_after: str = ""
    done: bool = False


@dataclass
class _Half:
    """One side of one automaton."""

    acts: deque[tuple[int, bytes]] = field(default_factory=deque)
    """What it did and the other has not done yet: the time of the cycle, and the message."""
    frames: dict[int, _Frame] = field(default_factory=dict)
    at: int | None = None
    state: str = ""
    variables: dict[str, Any] = field(default_factory=dict)

    def side(self, at: int) -> Side:
        frame = self.frames.get(at)
        if frame is None:
            return Side(self.state, {}, [], [], self.state, False)
        return Side(frame.state, frame.guards, frame.fired, frame.errors, frame.state_after, True)


@dataclass
class _Pair:
    """An automaton in the recording and in the replay."""

    automaton: int
    name: str
    recorded: _Half = field(default_factory=_Half)
    replayed: _Half = field(default_factory=_Half)
    parted_at: int | None = None


class Comparison:
    """Take both traces as they come; after `finish` it says what it found.

    `divergences` are acts that differ: changes of state, transitions, events, errors; at most one of each
    automaton, in the order of time. `differences` are values that differ, while the acts are the same.
    """

    def __init__(self) -> None:
        self.divergences: list[Divergence] = []
        self.differences: list[Difference] = []
        self.cycles = 0
        """Cycles that were replayed."""
        self.unmatched = 0
        """Cycles that only one of the two has."""
        self.recorded_steps: list[Step] = []
        self.replayed_steps: list[Step] = []
        self._pairs: dict[object, _Pair] = {}
        self._encoder = msgspec.json.Encoder()
        self._told: set[tuple[int, str, str]] = set()

    @property
    def identical(self) -> bool:
        """Whether every change of state, transition, guard, variable, event and error was the same."""
        return not (self.divergences or self.differences or self.unmatched)

    def recorded(self, record: Record) -> None:
        """Take a record of the recording."""
        self._take(record.time, record.message, record.data, recorded=True)

    def replayed(self, time: int, message: Message) -> None:
        """Take what the replay would have recorded."""
        self._take(time, message, self._encoder.encode(message), recorded=False)

    def finish(self) -> None:
        """Take notice that both are over: an act that only the recording has is a difference."""
        for pair in self._pairs.values():
            if pair.parted_at is None and pair.recorded.acts:
                pair.parted_at = pair.recorded.acts[0][0]
            at = pair.parted_at
            if at is not None:
                sides = pair.recorded.side(at), pair.replayed.side(at)
                self.divergences.append(Divergence(at / _SECOND, pair.automaton, pair.name, *sides))
            else:
                # What the replay has begun when the recording ends is no difference.
                self.unmatched += sum(frame.done for frame in pair.recorded.frames.values())
        self.divergences.sort(key=lambda divergence: divergence.time)

    def _take(self, time: int, message: Message, data: bytes, *, recorded: bool) -> None:
        if isinstance(message, Timers):  # they follow from the changes of state
            return
        if isinstance(message, EventSent):
            pair = self._pair(f"events of {message.context}", 0, message.context or "events from outside")
        elif isinstance(message, Change | Cycle | Failure | Firing | Guard | Variables):
            pair = self._pair(message.automaton, message.automaton, message.name)
        else:
            return
        half = pair.recorded if recorded else pair.replayed
        self._note(half, message, recorded=recorded)
        if pair.parted_at is not None:
            return
        if isinstance(message, _ACTS):
            at = message.at if isinstance(message, Change) else half.at
            half.acts.append((time if at is None else at, data))
            self._compare_acts(pair)
        elif isinstance(message, Cycle) and not message.begins:
            self._compare_values(pair, message.at)

    def _pair(self, key: object, automaton: int, name: str) -> _Pair:
        if key not in self._pairs:
            self._pairs[key] = _Pair(automaton, name)
        return self._pairs[key]

    def _note(self, half: _Half, message: Message, *, recorded: bool) -> None:
        frame = half.frames.get(half.at) if half.at is not None else None
        match message:
            case Cycle(begins=True, at=at):
                half.at = at
                half.frames[at] = _Frame(half.state, state_after=half.state)
                self.cycles += not recorded
            case Cycle():
                half.at = None
                if frame is not None:
                    frame.variables, frame.done = dict(half.variables), True
            case Change():
                half.state = message.state_name
                step = Step(
                    message.at / _SECOND, message.automaton, message.name, message.state_name, message.kind
                )
                (self.recorded_steps if recorded else self.replayed_steps).append(step)
                if frame is not None:
                    frame.state_after = message.state_name
            case Variables():
                half.variables.update(message.values)
                for name in message.gone:
                    half.variables.pop(name, None)
            case Guard() if frame is not None:
                frame.guards[_name(message)] = message.value
            case Firing() if frame is not None:
                frame.fired.append(_name(message))
            case Failure() if frame is not None:
                frame.errors.append(message.message)

    def _compare_acts(self, pair: _Pair) -> None:
        ours, theirs = pair.recorded.acts, pair.replayed.acts
        while ours and theirs:
            if ours[0][1] != theirs[0][1]:
                pair.parted_at = min(ours[0][0], theirs[0][0])
                return
            ours.popleft()
            theirs.popleft()

    def _compare_values(self, pair: _Pair, at: int) -> None:
        ours, theirs = pair.recorded.frames.get(at), pair.replayed.frames.get(at)
        if ours is None or theirs is None or not (ours.done and theirs.done):
            return
        for kind, mine, other in (
            ("guard", ours.guards, theirs.guards),
            ("variable", ours.variables, theirs.variables),
        ):
            names = mine.keys() & other.keys() if kind == "guard" else mine.keys() | other.keys()
            for name in sorted(names):
                if self._encoder.encode(mine.get(name)) != self._encoder.encode(other.get(name)):
                    self._tell(pair, at, kind, name, mine.get(name), other.get(name))
        if pair.parted_at != at:
            del pair.recorded.frames[at], pair.replayed.frames[at]

    def _tell(self, pair: _Pair, at: int, kind: Any, name: str, ours: object, theirs: object) -> None:  # noqa: ANN401
        key = (pair.automaton, kind, name)
        if key not in self._told and len(self._told) < _MOST_DIFFERENCES:
            self._told.add(key)
            found = Difference(at / _SECOND, pair.automaton, pair.name, kind, name, ours, theirs)
            self.differences.append(found)


def _name(message: Guard | Firing) -> str:
    return message.transition_name or str(message.transition)
