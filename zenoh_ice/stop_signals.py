"""Signals that end a program, as SystemExit where that does no harm."""

from __future__ import annotations

import _thread
import logging
import os
import signal
import threading
import time
from types import FrameType
from typing import Final

__all__ = ["StopOnSignal"]

_CLEANUP_GRACE: Final = (
    10.0  # s after a signal in which further ones are ignored, so that cleaning up can end
)
_LATER: Final = 0.001  # s

# Python code that takes locks and gives them back: an exception in the middle of it would leave a lock taken
# for ever, and whoever needs it to clean up would hang.
_BOOKKEEPERS: Final = frozenset({threading.__file__, logging.__file__})
# What blocks there is fit to be broken off.
_BLOCKING: Final = frozenset({"wait", "wait_for", "join", "_wait_for_tstate_lock"})


class StopOnSignal:
    """Turn SIGINT, SIGTERM and SIGHUP into SystemExit in the main thread."""

    def __init__(self) -> None:
        self._stopped_at: float | None = None

    def install(self) -> None:
        """Take the signals from now on; SIGHUP unless it is ignored, as under nohup."""
        signal.signal(signal.SIGINT, self._stop)
        signal.signal(signal.SIGTERM, self._stop)
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
            signal.signal(signal.SIGHUP, self._stop)

    def _stop(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if self._stopped_at is not None and now - self._stopped_at < _CLEANUP_GRACE:
            return
        if _keeps_books(frame):
            # Not by a Thread: the books may be those of starting one.
            _thread.start_new_thread(_send_again, (number,))
            return
        self._stopped_at = now
        raise SystemExit(128 + number)


def _send_again(number: int) -> None:
    time.sleep(_LATER)
    os.kill(os.getpid(), number)


def _keeps_books(frame: FrameType | None) -> bool:
    while frame is not None:
        code = frame.f_code
        if code.co_filename in _BOOKKEEPERS and code.co_name not in _BLOCKING:
            return True
        frame = frame.f_back
    return False
