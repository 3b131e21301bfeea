"""Behaviors that take turns in one world: in each control tick, each catches up by its own clock."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from hfsm_runtime.virtual.clock import TaskClock
from hfsm_runtime.virtual.execution import Execution
from zenoh_ice import VirtualClock

_NANOSECONDS: Final = 1_000_000_000
TICK: Final = 10_000_000
"""ns from one control tick of the robots to the next: so far one behavior runs ahead of the others."""


class Turns:
    """The clock of a world, and those of what lives there, which move it.

    In each control tick the world moves first, with the first one that gets there; the others follow in
    their order. So code that sleeps leaves the others alone, and the same code does the same every time.
    """

    def __init__(self) -> None:
        self.clock: Final = VirtualClock()
        """That of the world."""

    def make_clock(self) -> TaskClock:
        """Return the clock of another one that lives there."""
        clock = TaskClock()
        clock.call_every(TICK / _NANOSECONDS, lambda: self._reach(clock.moment))
        return clock

    def pass_time(self, seconds: float) -> Iterator[int]:
        """Let time pass, and yield the moment of each control tick in ns, for all to catch up with it."""
        now = self.clock.moment
        end = now + round(seconds * _NANOSECONDS)
        while now < end:
            now = min(now + TICK - now % TICK, end)
            yield now
            self._reach(now)

    def _reach(self, moment: int) -> None:
        self.clock.advance(max(0, moment - self.clock.moment) / _NANOSECONDS)


def catch_up(run: Execution | TaskClock, moment: int) -> None:
    """Let the time of an execution pass until a moment in ns, unless code that waited is ahead of it."""
    behind = moment - (run if isinstance(run, TaskClock) else run.world.clock).moment
    if behind >= 0:
        run.advance(behind / _NANOSECONDS)
