"""What a recording knows at a moment: for code that asks for what nobody had asked for then."""

from __future__ import annotations

from collections import Counter
from typing import Final

from hfsm_recording.messages import Reading, Result

from .script import Record, Want, attribute_of

__all__ = ["Knowledge"]

_SECOND: Final = 1e9
_CLOCKS: Final = {"now": 1.0, "time.time": 1.0, "time.monotonic": 1.0, "time.perf_counter": 1.0}
_CLOCKS_NS: Final = {"time.time_ns", "time.monotonic_ns", "time.perf_counter_ns"}
_VALUES: Final = frozenset({"call", "latest", "wait", "async", "sample"})
_POLL: Final = 1000
"""ns that pass when an edited document reads a clock, so that a loop that waits by it comes to its end."""


class Knowledge:
    """Collect what a recording brings, and answer from it by the newest."""

    def __init__(self) -> None:
        self.guesses: Counter[str] = Counter()
        """How often what was asked for in vain, and answered by something older."""
        self._results: dict[tuple[str, str], Record] = {}
        self._readings: dict[str, tuple[float, int]] = {}
        self._passed: dict[str, int] = {}

    def learn(self, record: Record) -> None:
        """Take what was recorded."""
        message = record.message
        if isinstance(message, Result):
            if message.kind in _VALUES and message.packed is not None:
                self._results[attribute_of(record), message.operation] = record
        elif (
            isinstance(message, Reading)
            and message.kind in _CLOCKS.keys() | _CLOCKS_NS
            and isinstance(message.value, int | float)
        ):
            self._readings[message.kind] = float(message.value), record.time

    def newest(self, want: Want) -> Record | None:
        """Return the newest value that an operation had, or None."""
        return self._results.get((want.attribute, want.operation))

    def begin_cycle(self, context: str) -> None:
        """Forget how long the code of a context has waited in its cycle."""
        self._passed[context] = 0

    def wait(self, context: str, seconds: float) -> None:
        """Let time pass for the code of a context, until the end of its cycle."""
        self._passed[context] = self._passed.get(context, 0) + round(max(0.0, seconds) * _SECOND)

    def time(self, context: str, now: int) -> int:
        """Return the component time in ns as the code of a context sees it."""
        self._passed[context] = self._passed.get(context, 0) + _POLL
        return now + self._passed[context]

    def reading(self, want: Want, context: str, now: int) -> float | int | bool | str | None:
        """Return what a clock shows, or how a wait ends, at a component time in ns."""
        time = self.time(context, now)
        kind = want.kind
        if kind == "component":
            return time
        if kind in _CLOCKS or kind in _CLOCKS_NS:
            scale = 1.0 if kind in _CLOCKS_NS else _SECOND
            value, at = self._readings.get(kind, (0.0, 0))
            return int(value + (time - at)) if kind in _CLOCKS_NS else value + (time - at) / scale
        endings: dict[str, float | bool | str] = {
            "rate": 1.0, "sleep": "done", "clock.wait": False, "future": True,
        }  # fmt: skip
        return endings.get(kind)
