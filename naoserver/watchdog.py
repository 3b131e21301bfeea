"""The thread that sees to it that nothing moves that should not."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Sequence
from typing import Final, Protocol

_logger = logging.getLogger(__name__)

_LONGEST: Final = 1.0
_AFTER_ERROR: Final = 0.1
_END: Final = 2.0


class Watched(Protocol):
    """What can move and must not for longer than its client wants it: joints, and the walk."""

    @property
    def name(self) -> str:
        """What it is called in the log."""
        ...

    def watch(self) -> float | None:
        """Stop what was not renewed; return in how many wall seconds to look again, None while all rests."""
        ...

    def drop_client(self, client: str) -> None:
        """Stop what a lost client drives."""
        ...

    def close(self) -> None:
        """Stop, and refuse further motion."""
        ...


class Watchdog:
    """Look after devices on the steady wall clock: sleep while all rest, and wake with the first command."""

    def __init__(self) -> None:
        self._devices: Sequence[Watched] = ()
        self._condition = threading.Condition()
        self._next_look = math.inf  # in steady wall time
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="watchdog", daemon=True)

    def start(self, devices: Sequence[Watched]) -> None:
        """Start to look after `devices`."""
        self._devices = tuple(devices)
        self._thread.start()

    def look_within(self, seconds: float) -> None:
        """Look again in at most `seconds`: something has been commanded."""
        when = time.monotonic() + seconds
        with self._condition:
            if when < self._next_look:
                self._next_look = when
                self._condition.notify()

    def close(self) -> None:
        """End the thread."""
        with self._condition:
            self._stopping = True
            self._condition.notify()
        if self._thread.ident is not None:
            self._thread.join(_END)
            if self._thread.is_alive():
                _logger.error("the watchdog did not end within %g s", _END)

    def _run(self) -> None:
        while True:
            with self._condition:
                self._next_look = math.inf  # so that a command during the look is not missed
            due = min((self._watch(device) for device in self._devices), default=_LONGEST)
            with self._condition:
                self._next_look = min(self._next_look, time.monotonic() + due)
                while not self._stopping and (left := self._next_look - time.monotonic()) > 0:
                    self._condition.wait(left)
                if self._stopping:
                    return

    def _watch(self, device: Watched) -> float:
        """Look after a device; return in how many seconds to look again."""
        try:
            due = device.watch()
        except Exception:
            _logger.exception("the watchdog could not look after %s", device.name)
            return _AFTER_ERROR
        return _LONGEST if due is None else due
