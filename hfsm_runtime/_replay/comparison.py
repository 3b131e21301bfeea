"""Compare a replay with its recording, automaton by automaton, and report where they diverge."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import msgspec

from hfsm_runtime.recording_file import messages
from hfsm_runtime.recording_file.outcome import Difference, Divergence, Side, Step

from .script import TimedMessage

_SECOND: Final = 1e9
_ACTS: Final = (messages.Change, messages.Firing, messages.Failure, messages.EventSent)
_MOST_DIFFERENCES: Final = 200
_MOST_AUTOMATA: Final = 10_000
_MOST_STEPS: Final = 100_000
_MOST_BEHIND: Final = 10_000
"""Acts, or cycles, by which one side may lag behind the other before they count as diverged."""


@dataclass
class _Frame:
    """One cycle of one automaton; it has `variables` once it has ended."""

    side: Side
    variables: dict[str, Any] | None = None


@dataclass
class _Half:
    """One side of one automaton."""

    acts: deque[tuple[int, bytes]] = field(default_factory=deque)
    """The acts that came before the other side's: the time of the cycle, and the message."""
    frames: dict[int, _Frame] = field(default_factory=dict)
    at: int | None = None
    state: str = ""
    variables: dict[str, Any] = field(default_factory=dict)

    def side(self, at: int, steps: list[Step]) -> Side:
        if at in self.frames:
            return self.frames[at].side
        # There is no such cycle, or the comparison no longer has it.
        before = ["", *(step.state for step in steps if step.time < at / _SECOND)]
        after = ["", *(step.state for step in steps if step.time <= at / _SECOND)]
        return Side(before[-1], after[-1], ran=False)


@dataclass
class _Pair:
    """An automaton in the recording and in the replay."""

    automaton: int
    name: str
    recorded: _Half = field(default_factory=_Half)
    replayed: _Half = field(default_factory=_Half)
    parted_at: int | None = None


class Comparison:
    """Take both traces as they arrive; the results are complete after `finish`.

    `divergences` are acts that differ: changes of state, transitions, events, errors; at most one of each
    automaton, in the order of time. `differences` are values that differ, while the acts are the same.
    """

    def __init__(self) -> None:
        self.divergences: list[Divergence] = []
        self.differences: list[Difference] = []
        self.cycles = 0
        """Cycles that were replayed."""
        self.unmatched = 0
        """Cycles that only the recording has."""
        self.recorded_steps: list[Step] = []
        self.replayed_steps: list[Step] = []
        self._pairs: dict[object, _Pair] = {}
        self._encoder = msgspec.json.Encoder()
        self._recorded_cycles = 0
        self._reported: set[tuple[int, str, str]] = set()

    @property
    def identical(self) -> bool:
        """Whether every change of state, transition, guard, variable, event and error was the same."""
        return not (self.divergences or self.differences or self.unmatched)

    def recorded(self, record: TimedMessage) -> None:
        """Take a record of the recording."""
        self._add(record.time, record.message, record.data, recorded=True)

    def replayed(self, time: int, message: messages.Message) -> None:
        """Take a message that a recording of the replay would have."""
        self._add(time, message, self._encoder.encode(message), recorded=False)

    def called(self, time: int, context: str, what: str, recorded: object, replayed: object) -> None:
        """Take the arguments of a call."""
        if self._encoder.encode(recorded) != self._encoder.encode(replayed):
            number = context.removeprefix("automaton ")
            pair = self._pairs.get(int(number)) if number.isdigit() else None
            automaton, name = (pair.automaton, pair.name) if pair else (0, context)
            self._report(Difference(time / _SECOND, automaton, name, "call", what, recorded, replayed))

    def finish(self) -> None:
        """End the comparison: an act that only the recording has is a difference."""
        for pair in self._pairs.values():
            if pair.parted_at is None and pair.recorded.acts:
                pair.parted_at = pair.recorded.acts[0][0]
            at = pair.parted_at
            if at is not None:
                recorded = [step for step in self.recorded_steps if step.automaton == pair.automaton]
                replayed = [step for step in self.replayed_steps if step.automaton == pair.automaton]
                sides = pair.recorded.side(at, recorded), pair.replayed.side(at, replayed)
                self.divergences.append(Divergence(at / _SECOND, pair.automaton, pair.name, *sides))
        self.unmatched = max(0, self._recorded_cycles - self.cycles)
        self.divergences.sort(key=lambda divergence: divergence.time)

    def _add(self, time: int, message: messages.Message, data: bytes, *, recorded: bool) -> None:
        if isinstance(message, messages.EventSent):
            pair = self._pair(f"events of {message.context}", 0, message.context or "events from outside")
        elif isinstance(message, messages.OfAutomaton):
            pair = self._pair(message.automaton, message.automaton, message.name)
        else:
            return
        if pair is None:
            return
        if isinstance(message, messages.OfAutomaton) and message.name != pair.name:
            # The document was renamed, and with it its root automaton.
            message = msgspec.structs.replace(message, name=pair.name)
            data = self._encoder.encode(message)
        half = pair.recorded if recorded else pair.replayed
        self._note(half, message, recorded=recorded)
        if pair.parted_at is not None:
            return
        if isinstance(message, _ACTS):
            at = message.at if isinstance(message, messages.Change) else half.at
            half.acts.append((time if at is None else at, data))
            self._compare_acts(pair)
        elif isinstance(message, messages.Cycle) and not message.begins:
            self._compare_values(pair, message.at)

    def _pair(self, key: object, automaton: int, name: str) -> _Pair | None:
        if key not in self._pairs and len(self._pairs) < _MOST_AUTOMATA:
            self._pairs[key] = _Pair(automaton, name)
        return self._pairs.get(key)

    def _note(self, half: _Half, message: messages.Message, *, recorded: bool) -> None:
        frame = half.frames.get(half.at) if half.at is not None else None
        match message:
            case messages.Cycle(begins=True, at=at):
                half.at = at
                half.frames[at] = _Frame(Side(half.state, half.state))
                if len(half.frames) > _MOST_BEHIND:
                    del half.frames[next(iter(half.frames))]
                self.cycles += not recorded
                self._recorded_cycles += recorded
            case messages.Cycle():
                half.at = None
                if frame is not None:
                    frame.variables = dict(half.variables)
            case messages.Change():
                half.state = message.state_name
                step = Step(
                    message.at / _SECOND, message.automaton, message.name, message.state_name, message.kind
                )
                steps = self.recorded_steps if recorded else self.replayed_steps
                if len(steps) < _MOST_STEPS:
                    steps.append(step)
                if frame is not None:
                    frame.side.state_after = message.state_name
            case messages.Variables():
                half.variables.update(message.values)
                for name in message.gone:
                    half.variables.pop(name, None)
            case messages.Guard() if frame is not None:
                frame.side.guards[_name(message)] = message.value
            case messages.Firing() if frame is not None:
                frame.side.fired.append(_name(message))
            case messages.Failure() if frame is not None:
                frame.side.errors.append(message.message)

    def _compare_acts(self, pair: _Pair) -> None:
        ours, theirs = pair.recorded.acts, pair.replayed.acts
        while ours and theirs:
            if ours[0][1] != theirs[0][1]:
                pair.parted_at = min(ours[0][0], theirs[0][0])
                return
            ours.popleft()
            theirs.popleft()
        for acts in (ours, theirs):
            if len(acts) > _MOST_BEHIND:
                pair.parted_at = acts[0][0]

    def _compare_values(self, pair: _Pair, at: int) -> None:
        ours, theirs = pair.recorded.frames.get(at), pair.replayed.frames.get(at)
        if ours is None or theirs is None or ours.variables is None or theirs.variables is None:
            return
        kinds: tuple[tuple[Literal["guard", "variable"], dict[str, Any], dict[str, Any]], ...] = (
            ("guard", ours.side.guards, theirs.side.guards),
            ("variable", ours.variables, theirs.variables),
        )
        for kind, mine, other in kinds:
            names = mine.keys() & other.keys() if kind == "guard" else mine.keys() | other.keys()
            for name in sorted(names):
                if self._encoder.encode(mine.get(name)) != self._encoder.encode(other.get(name)):
                    values = mine.get(name), other.get(name)
                    self._report(Difference(at / _SECOND, pair.automaton, pair.name, kind, name, *values))
        waiting = [half.acts[0][0] for half in (pair.recorded, pair.replayed) if half.acts]
        if waiting and waiting[0] <= at:  # by now the other side would have done the same
            pair.parted_at = waiting[0]
        for half in (pair.recorded, pair.replayed):
            for old in [each for each in half.frames if each < at]:
                del half.frames[old]

    def _report(self, found: Difference) -> None:
        key = (found.automaton, found.kind, found.what)
        if key not in self._reported and len(self._reported) < _MOST_DIFFERENCES:
            self._reported.add(key)
            self.differences.append(found)


def _name(message: messages.Guard | messages.Firing) -> str:
    return message.transition_name or str(message.transition)
