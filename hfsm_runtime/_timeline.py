"""Component time: the active time since the start of a component, and the schedule of cycles in it."""

from __future__ import annotations

import threading
from typing import Final

from zenoh_ice.threads.clock import Clock

from ._limits import RuntimeLimits

SECOND: Final = 1_000_000_000
_LONGEST_WAIT: Final = 0.5
"""The longest wait on the clock in s: a simulation that restarts must not hold a component up."""
_APART: Final = 50_000
"""ns between the wake-ups of two automata whose slots fall together: about what a cycle takes on a thread."""


class Timeline:
    """Component time in integer ns: it stands still while the component is paused, and never runs backwards.

    When the clock does, because a simulation was restarted, component time continues from where it was. While
    it stands still, `wait_until` lasts at most `paused_wait` s of wall time.
    """

    def __init__(self, clock: Clock, paused_wait: float = RuntimeLimits.paused) -> None:
        self._clock = clock
        self._paused_wait = paused_wait
        self._lock = threading.Lock()
        self._latest = _nanoseconds(clock)
        self._zero = self._latest
        self._paused_at: int | None = None

    @property
    def paused(self) -> bool:
        """Whether time stands still."""
        return self._paused_at is not None

    def now(self) -> int:
        """Return the component time in ns."""
        with self._lock:
            return self._now()

    def restart(self) -> None:
        """Make this moment the zero of component time."""
        with self._lock:
            self._zero = self._latest = _nanoseconds(self._clock)

    def pause(self) -> None:
        """Let time stand still."""
        with self._lock:
            if self._paused_at is None:
                self._paused_at = self._now()

    def resume(self) -> None:
        """Let time continue."""
        with self._lock:
            if self._paused_at is not None:
                self._latest = _nanoseconds(self._clock)
                self._zero = self._latest - self._paused_at
                self._paused_at = None

    def step(self, duration: int) -> None:
        """Move time forward by a duration in ns while it stands still."""
        with self._lock:
            if self._paused_at is not None:
                self._paused_at += duration

    def wait_until(self, when: int, wake: threading.Event) -> None:
        """Wait until a component time in ns, or until the event is set; it may end early."""
        left = when - self.now()
        if self.paused:
            wake.wait(self._paused_wait)
        elif left > 0:
            self._clock.wait(wake, min(left / SECOND, _LONGEST_WAIT))

    def _now(self) -> int:
        if self._paused_at is not None:
            return self._paused_at
        reading = _nanoseconds(self._clock)
        if reading < self._latest:
            self._zero += reading - self._latest
        self._latest = reading
        return self._latest - self._zero


def _nanoseconds(clock: Clock) -> int:
    return round(clock.now() * SECOND)


# The schedule: cycles at whole multiples of the period. A slot that was missed is not made up for.


def slot_at(now: int, interval: int) -> int:
    """Return the latest slot that is not in the future."""
    return now // interval * interval


def slot_after(now: int, interval: int) -> int:
    """Return the first slot in the future."""
    return slot_at(now, interval) + interval


def slot_from(now: int, interval: int) -> int:
    """Return the first slot that is not in the past."""
    return -(-now // interval) * interval


def delay_in_slot(index: int, interval: int) -> int:
    """Return how long after the beginning of its slots the automaton of this number wakes.

    Threads that all woke at once would compete for the interpreter, and some would get it late. The cycle
    belongs to the time of its slot nevertheless.
    """
    return index * _APART % interval
