"""Since when this process has surely run: what arrives after it stood still may have waited for hours."""

from __future__ import annotations

import logging
import threading
import time
from typing import Final

__all__ = ["Pulse"]

_PERIOD: Final = 0.1  # s
_STANDSTILL: Final = 0.5  # s without a beat: more than a busy machine makes of the period
_AFTERMATH: Final = 10  # beats until all that waited has been read
_JOIN_LIMIT: Final = 2.0

_logger = logging.getLogger(__name__)

# The clock that goes on while the machine is suspended, where the system has one.
_CLOCK: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)


class Pulse:
    """Beat on a thread, and notice from the missing beats that the process stood still.

    A process that was stopped (SIGSTOP, a debugger, a suspended machine) finds calls in the system's buffers
    whose callers gave up long ago. They look as if they had just come; that they may be old shows here alone.
    """

    def __init__(self) -> None:
        self.running_since = time.monotonic()
        """What is received now came after this moment of the monotonic clock, usually 0.1 s ago at most."""
        self._stopped = threading.Event()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to beat, unless it does already or was closed."""
        with self._lock:
            if self._thread is None and not self._stopped.is_set():
                self.running_since = time.monotonic()
                thread = threading.Thread(target=self._beat, name="zenoh_ice pulse", daemon=True)
                thread.start()
                self._thread = thread

    def close(self) -> None:
        """End the thread."""
        with self._lock:
            self._stopped.set()
            thread, self._thread = self._thread, None
        if thread is not None:
            thread.join(_JOIN_LIMIT)

    def _beat(self) -> None:
        last = time.clock_gettime(_CLOCK)
        doubtful = 0
        while not self._stopped.wait(_PERIOD):
            moment = time.clock_gettime(_CLOCK)
            pause, last = moment - last, moment
            if pause > _STANDSTILL:
                _logger.info("this process stood still for %.1f s", pause)
                self.running_since = time.monotonic() - pause
                doubtful = _AFTERMATH
            elif doubtful:
                doubtful -= 1
            else:
                self.running_since = time.monotonic()
