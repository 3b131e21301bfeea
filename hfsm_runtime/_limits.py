"""The longest waits of a component that runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class RuntimeLimits:
    """The longest waits of a component that runs, in s of wall time."""

    gap: float = 0.5
    """A reload waits for a moment without any cycle, and then again while no other cycle may begin."""
    hand_over: float = 1.0
    """A state that is left waits for the cycles of the automata below it."""
    hangs: float = 2.0
    """A cycle that lasts longer hangs, if its automaton has a short period."""
    idle: float = 2.0
    """A thread that has nothing to do rests; any change that concerns it wakes it."""
    paused: float = 1.0
    """A thread rests while component time stands still."""
    retry: float = 1.0
    """The automata wait after a refused command, and between two questions whether they may try again."""
    step: float = 2.0
    """A step waits for the cycle of each automaton."""
    stop: float = 2.0
    """The end of the component waits for the cycles that run."""


LIMITS: Final = RuntimeLimits()
"""The limits of every component outside of tests."""
