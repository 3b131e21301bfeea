"""The module `time` of user code, which follows the virtual clock while that code runs."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, Final

from zenoh_ice.clock import VirtualClock

from .._recording.clocks import InterceptedTime
from ..component import Component


class TimeModule:
    """Let `time` follow a clock in the code of a component.

    This holds for the thread that made this object, or took it over. Others, which user code starts, see wall
    time: they must not move the clock.
    """

    def __init__(self, clock: VirtualClock) -> None:
        self._clock: Final = clock
        # In whole seconds: sums with a fraction would be rounded differently in each run.
        self._date: Final = math.floor(time.time() - clock.now())
        self._thread = threading.get_ident()
        self._shown: Final = InterceptedTime(self._read)

    def take_over(self) -> None:
        """Let this thread be the one whose code sees virtual time."""
        self._thread = threading.get_ident()

    def shown_to(self, component: Component) -> AbstractContextManager[None]:
        """Let the module follow the clock in a `with` block, in the code of this component."""
        return self._shown.shown_to(type(component))

    def _read(self, kind: str, read: Callable[[], Any], waits: Callable[[], float] | None) -> object:
        name = kind.removeprefix("time.")
        if threading.get_ident() != self._thread or name == "process_time":
            return read()
        if waits is not None and waits() >= 0:
            self._clock.sleep(waits())
            return None
        if name == "sleep":
            return read()  # which raises
        now = self._clock.now() + (self._date if name.startswith("time") else 0.0)
        return round(now * 1e9) if name.endswith("_ns") else now
