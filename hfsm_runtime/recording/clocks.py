"""Clocks that are recorded: the component's own, and the module `time` where user code imported it."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import ModuleType
from typing import Any, Final

from zenoh_ice.clocks.clock import Clock

from ..timeline import Timeline
from .recorder import Recorder

__all__ = ["TIME_FUNCTIONS", "RecordingClock", "RecordingTimeline", "recorded_time", "replaced_time"]

TIME_FUNCTIONS: Final = (
    "time", "time_ns", "monotonic", "monotonic_ns", "perf_counter", "perf_counter_ns", "process_time",
    "sleep",
)  # fmt: skip
"""The functions of the module `time` that are recorded."""


class RecordingClock:
    """The clock that user code sees: it tells and waits as the one that it stands for."""

    def __init__(self, clock: Clock, recorder: Recorder) -> None:
        self.genuine: Final = clock
        self._recorder = recorder

    @property
    def rate(self) -> float:
        """The seconds of this clock that pass in a second of wall time."""
        value = self.genuine.rate
        self._recorder.reading("rate", value)
        return value

    @property
    def simulated(self) -> bool:
        """Whether the time is that of a simulation."""
        return self.genuine.simulated

    def now(self) -> float:
        """Return the time in s."""
        value = self.genuine.now()
        self._recorder.reading("now", value)
        return value

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s."""
        with self._recorder.turns.waiting():
            self.genuine.sleep(seconds)
        self._recorder.reading("clock.sleep", None)

    def sleep_until(self, when: float) -> None:
        """Wait until a time in s."""
        with self._recorder.turns.waiting():
            self.genuine.sleep_until(when)
        self._recorder.reading("clock.sleep_until", None)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s; return whether it is set."""
        with self._recorder.turns.waiting():
            value = self.genuine.wait(event, timeout)
        self._recorder.reading("clock.wait", value)
        return value


class RecordingTimeline(Timeline):
    """Component time, of which the readings within cycles are recorded."""

    def __init__(self, clock: Clock, recorder: Recorder) -> None:
        super().__init__(clock)
        self._recorder = recorder
        recorder.component_time = super().now

    def now(self) -> int:
        """Return the component time in ns."""
        value = super().now()
        self._recorder.reading("component", value)
        return value


@contextmanager
def replaced_time(
    component: type, make: Callable[[str, Callable[..., Any]], Callable[..., Any]]
) -> Iterator[None]:
    """Let a component's module see other functions of the module `time` in a `with` block.

    They are replaced where the module has imported them. `make` gets the name of each of `TIME_FUNCTIONS` and
    the function, and returns what stands for it.
    """
    module = sys.modules.get(component.__module__)
    if module is None:
        yield
        return
    made = {name: make(name, getattr(time, name)) for name in TIME_FUNCTIONS}
    stand_in = ModuleType("time", time.__doc__)
    vars(stand_in).update({**vars(time), **made})
    functions = {getattr(time, name): made[name] for name in TIME_FUNCTIONS}
    genuine: dict[str, object] = {}
    for name, value in list(vars(module).items()):
        is_function = getattr(value, "__module__", None) == "time" and value in functions
        if value is time or is_function:
            genuine[name] = value
            setattr(module, name, functions[value] if is_function else stand_in)
    try:
        yield
    finally:
        vars(module).update(genuine)


def recorded_time(component: type, recorder: Recorder) -> AbstractContextManager[None]:
    """Return the `with` block in which is recorded what user code reads of the module `time`."""

    def make(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def read(*arguments: float) -> object:
            if name == "sleep":
                with recorder.turns.waiting():
                    function(*arguments)
                value = None
            else:
                value = function(*arguments)
            recorder.reading(f"time.{name}", value)
            return value

        return read

    return replaced_time(component, make)
