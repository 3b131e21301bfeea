"""What was seen of a component and its robot: a time series of bounded length, and what happened in it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from interfaces.hfsm import AutomatonSnapshot, ComponentSnapshot
from visualhfsm.watch.automata import Automata

__all__ = ["ARM_JOINTS", "Ball", "Change", "Recording", "RobotReading", "Row", "Span", "read_ball"]

ARM_JOINTS: Final = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")
"""Joints of an arm that are shown and recorded; L or R goes before the name."""

_LONGEST: Final = 36_000
"""Rows kept: an hour of snapshots at 10 a second."""
_LONGEST_HISTORY: Final = 5_000
"""Changes of state and spans kept."""


@dataclass(frozen=True, slots=True)
class Ball:
    """Where a component sees its ball: pixels from the image's center, right and down.

    `name` is that of the automaton that looks for it, `following_since` the component time since which it
    does so without a break.
    """

    name: str
    error_u: float
    error_v: float
    seen: bool
    following_since: float


@dataclass(frozen=True, slots=True)
class RobotReading:
    """What is known of the robot at one moment; None is what is not known or too old."""

    pan: float | None = None
    tilt: float | None = None
    joints: Mapping[str, float] = field(default_factory=dict)
    real_time_factor: float | None = None
    lag: float | None = None
    torso_tilt: float | None = None
    camera_rate: float | None = None


@dataclass(frozen=True, slots=True)
class Row:
    """A moment of the recording; `time` is the component's."""

    time: float
    ball: Ball | None
    robot: RobotReading


@dataclass(slots=True)
class Span:
    """A time during which an automaton stayed in one state, running or as a ghost."""

    automaton: int
    state: int
    ghost: bool
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Change:
    """A change of state, at the component time at which the new state was entered."""

    time: float
    automaton: int
    origin: int
    destination: int
    transition: int


class Recording:
    """A run of one component. Not thread safe: its owner sees to that."""

    def __init__(self, automata: Automata) -> None:
        self.automata = automata
        self.rows: deque[Row] = deque(maxlen=_LONGEST)
        self.changes: deque[Change] = deque(maxlen=_LONGEST_HISTORY)
        self.spans: deque[Span] = deque(maxlen=_LONGEST_HISTORY)
        self.newest: ComponentSnapshot | None = None
        self._open: dict[int, Span] = {}
        self._last: dict[int, AutomatonSnapshot] = {}

    @property
    def duration(self) -> float:
        """Seconds of the component's time from the first row to the last."""
        return self.rows[-1].time - self.rows[0].time if self.rows else 0.0

    def continued_by(self, snapshot: ComponentSnapshot) -> bool:
        """Whether a snapshot is of the same run after a reload of the component."""
        return snapshot.generation > self.automata.generation and (
            self.newest is None or snapshot.time >= self.newest.time
        )

    def follows(self, snapshot: ComponentSnapshot) -> bool:
        """Whether a snapshot can be of the same run: it is not older, and knows the same automata."""
        if self.newest is not None and snapshot.time < self.newest.time:
            return False
        return self.knows(snapshot)

    def knows(self, snapshot: ComponentSnapshot) -> bool:
        """Whether every automaton of a snapshot is one of the component's, with times that are numbers.

        After a reload of the component none is, until it has told its new automata.
        """
        if snapshot.generation != self.automata.generation:
            return False
        return math.isfinite(snapshot.time) and all(
            automaton.id in self.automata and math.isfinite(automaton.enteredAt)
            for automaton in snapshot.automata
        )

    def add(self, snapshot: ComponentSnapshot, robot: RobotReading) -> None:
        """Append a snapshot and what was known of the robot when it arrived."""
        before = self.newest.time if self.newest else math.inf
        if snapshot.time != before:  # a component that is paused tells the same time again and again
            self.rows.append(Row(snapshot.time, read_ball(self.automata, snapshot), robot))
        for automaton in snapshot.automata:
            self._note_change(automaton)
            self._note_span(automaton, before, snapshot.time)
            self._last[automaton.id] = automaton
        self.newest = snapshot

    def _note_change(self, automaton: AutomatonSnapshot) -> None:
        last = self._last.get(automaton.id)
        if last is None or (last.state, last.enteredAt) == (automaton.state, automaton.enteredAt):
            return
        if (
            automaton.lastTransition == 0
        ):  # the first entry, of an automaton that was a ghost from the beginning
            return
        change = Change(
            automaton.enteredAt, automaton.id, last.state, automaton.state, automaton.lastTransition
        )
        self.changes.append(change)

    def _note_span(self, automaton: AutomatonSnapshot, before: float, now: float) -> None:
        span = self._open.get(automaton.id)
        if span is not None and (span.state, span.ghost) == (automaton.state, automaton.ghost):
            span.end = now
            return
        # When a state was entered is told exactly; when a ghost came alive, only by the next snapshot.
        start = automaton.enteredAt if before < automaton.enteredAt <= now else now
        if span is not None:
            span.end = start
        self._open[automaton.id] = Span(automaton.id, automaton.state, automaton.ghost, start, now)
        self.spans.append(self._open[automaton.id])


def read_ball(automata: Automata, snapshot: ComponentSnapshot) -> Ball | None:
    """Find the ball that a component follows now.

    It is in the variables `error_u`, `error_v` and `ball_seen` of an automaton that is no ghost; None when
    there is no such automaton or the values are not numbers.
    """
    for automaton in snapshot.automata:
        variables = automaton.variables
        if automaton.ghost or not {"error_u", "error_v", "ball_seen"} <= variables.keys():
            continue
        error_u, error_v = _number(variables["error_u"]), _number(variables["error_v"])
        if error_u is None or error_v is None:
            continue
        return Ball(
            automata.automaton_name(automaton.id),
            error_u,
            error_v,
            variables["ball_seen"] == "True",
            automata.active_since(snapshot, automaton.id),
        )
    return None


def _number(text: str) -> float | None:
    # NumPy's own numbers show their type: np.float64(1.5).
    if text.startswith("np.") and text.endswith(")"):
        text = text[text.find("(") + 1 : -1]
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
