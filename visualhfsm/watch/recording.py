"""What was seen of a component and its robot: a time series of bounded length, and what happened in it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from interfaces.hfsm import ComponentSnapshot
from visualhfsm.watch.automata import Automata
from visualhfsm.watch.numbers import number_in
from visualhfsm.watch.state_log import Change, Span, StateLog

__all__ = ["ARM_JOINTS", "Ball", "Change", "Recording", "RobotReading", "Row", "Span", "read_ball"]

ARM_JOINTS: Final = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")
"""Joints of an arm that are shown and recorded; L or R goes before the name."""

_LONGEST: Final = 36_000
"""Rows kept: an hour of snapshots at 10 a second."""


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


class Recording:
    """A run of one component. Not thread safe: its owner sees to that."""

    def __init__(self, automata: Automata) -> None:
        self.automata = automata
        self.rows: deque[Row] = deque(maxlen=_LONGEST)
        self.newest: ComponentSnapshot | None = None
        self._log = StateLog()

    @property
    def changes(self) -> deque[Change]:
        """The newest changes of state."""
        return self._log.changes

    @property
    def spans(self) -> deque[Span]:
        """The newest times during which an automaton stayed in one state."""
        return self._log.spans

    @property
    def duration(self) -> float:
        """Seconds of the component's time from the first row to the last."""
        return self.rows[-1].time - self.rows[0].time if self.rows else 0.0

    def continued_by(self, snapshot: ComponentSnapshot) -> bool:
        """Whether a snapshot is of the same run after a reload of the component."""
        return snapshot.generation > self.automata.generation and (
            self.newest is None or snapshot.startedAt == self.newest.startedAt
        )

    def follows(self, snapshot: ComponentSnapshot) -> bool:
        """Whether a snapshot is of the same run, not older, and knows the same automata."""
        if self.newest is not None and (
            snapshot.startedAt != self.newest.startedAt or snapshot.time < self.newest.time
        ):
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
        self._log.add(snapshot)
        self.newest = snapshot


def read_ball(automata: Automata, snapshot: ComponentSnapshot) -> Ball | None:
    """Find the ball that a component follows now.

    It is in the variables `error_u`, `error_v` and `ball_seen` of an automaton that is no ghost; None when
    there is no such automaton or the values are not numbers.
    """
    for automaton in snapshot.automata:
        variables = automaton.variables
        if automaton.ghost or not {"error_u", "error_v", "ball_seen"} <= variables.keys():
            continue
        error_u, error_v = number_in(variables["error_u"]), number_in(variables["error_v"])
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
