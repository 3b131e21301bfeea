"""The report of a replay, as lines of JSON: the process that runs the code writes them for the command."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from .failures import FailureSpan


class Side(msgspec.Struct):
    """The actions of the recording, or of the replay, in the cycle in which they diverge."""

    state: str
    state_after: str
    guards: dict[str, bool] = {}
    fired: list[str] = []
    errors: list[str] = []
    ran: bool = True
    """False if it does not have that cycle at all."""


class Divergence(msgspec.Struct, frozen=True):
    """An automaton that behaves differently, in the cycle at a component time in s."""

    time: float
    automaton: int
    name: str
    recorded: Side
    replayed: Side


class Difference(msgspec.Struct, frozen=True):
    """A guard or a variable that has another value after a cycle, or a call with other arguments.

    Only the first of each is reported; a missing value is None.
    """

    time: float
    automaton: int
    name: str
    kind: Literal["guard", "variable", "call"]
    what: str
    recorded: Any = None
    replayed: Any = None


class Step(msgspec.Struct, frozen=True):
    """An automaton enters a state, becomes a ghost, resumes, or finishes, at a component time in s."""

    time: float
    automaton: int
    name: str
    state: str
    kind: str


class Begin(msgspec.Struct, frozen=True, tag="begin", tag_field="event"):
    """The recording was read; `failures` are what was made to fail meanwhile."""

    recording_seconds: float
    truncated: bool
    failures: list[FailureSpan] = []


class Progress(msgspec.Struct, frozen=True, tag="progress", tag_field="event"):
    """The replay has reached a component time."""

    seconds: float


class Outcome(msgspec.Struct, frozen=True, tag="end", tag_field="event"):
    """The replay is over."""

    error: str
    seconds: float
    cycles: int
    identical: bool
    missing_cycles: int
    divergences: list[Divergence]
    differences: list[Difference]
    recorded: list[Step]
    replayed: list[Step]
    guesses: dict[str, int]
    notes: list[str]


Line = Begin | Progress | Outcome
