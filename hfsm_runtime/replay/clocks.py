"""The time in a replay: the component's clock, its timeline, and the module `time`."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Final

from zenoh_ice.clocks.clock import WallClock

from ..timeline import Timeline
from .answers import Answers
from .script import Want

__all__ = ["ReplayClock", "ReplayTimeline", "time_function"]


class ReplayClock:
    """The component's clock."""

    simulated: Final = True

    def __init__(self, answers: Answers) -> None:
        self._answers = answers

    @property
    def rate(self) -> float:
        """The seconds of this clock that passed in a second of wall time."""
        return float(self._answers.read("rate"))

    def now(self) -> float:
        """Return the time in s."""
        return float(self._answers.read("now"))

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s."""
        self._answers.read("clock.sleep", waits=seconds)

    def sleep_until(self, when: float) -> None:
        """Wait until a time in s."""
        if self._answers.take(Want("clock.sleep_until")) is None:
            self._answers.pass_time(when - float(self._answers.read("now")))

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s; return whether it is set."""
        return bool(self._answers.read("clock.wait", waits=timeout)) or event.is_set()


class ReplayTimeline(Timeline):
    """Component time as it was."""

    def __init__(self, answers: Answers) -> None:
        super().__init__(WallClock())
        self._answers = answers

    def now(self) -> int:
        """Return the component time in ns."""
        return int(self._answers.read("component"))


def time_function(answers: Answers, name: str, genuine: Callable[..., Any]) -> Callable[..., Any]:  # noqa: ARG001
    """Return what stands for a function of the module `time`."""

    def read(*arguments: float) -> Any:  # noqa: ANN401 - int or float
        waits = float(arguments[0]) if name == "sleep" and arguments else 0.0
        value = answers.read(f"time.{name}", waits=waits)
        return None if name == "sleep" else value

    return read
