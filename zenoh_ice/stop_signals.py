"""Signals that end a program, as SystemExit where that does no harm."""

from __future__ import annotations

import _thread
import logging
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import CodeType, FrameType
from typing import Final, ParamSpec, TypeVar

__all__ = ["StopOnSignal", "unbroken"]

P = ParamSpec("P")
R = TypeVar("R")

_CLEANUP_GRACE: Final = (
    10.0  # s after a signal in which further ones are ignored, so that cleaning up can end
)
_LATER: Final = 0.001  # s

# Functions that Zenoh calls back: it swallows their exceptions, so a signal that strikes there would be lost.
_CALLBACKS: Final[set[CodeType]] = set()

# Python code that takes locks and gives them back: an exception in the middle of it would leave a lock taken
# for ever, and whoever needs it to clean up would hang.
_BOOKKEEPERS: Final = frozenset({threading.__file__, logging.__file__})
# What blocks there is fit to be broken off.
_BLOCKING: Final = frozenset({"wait", "wait_for", "join", "_wait_for_tstate_lock"})


class StopOnSignal:
    """Turn SIGINT, SIGTERM and SIGHUP into SystemExit in the main thread."""

    def __init__(self) -> None:
        self._stopped_at: float | None = None
        self.exit_code: int | None = None
        """The exit code of a program that the signal ends; None before one came."""

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
        if _must_go_on(frame):
            # Not by a Thread: what goes on may be the start of one.
            _thread.start_new_thread(_send_again, (number,))
            return
        self._stopped_at = now
        self.exit_code = 128 + number
        raise SystemExit(self.exit_code)


def unbroken(callback: Callable[P, R]) -> Callable[P, R]:
    """Let a function that Zenoh calls back go on to its end when a signal strikes; returns the function."""
    function = getattr(callback, "__func__", callback)
    _CALLBACKS.add(function.__code__)
    return callback


def _send_again(number: int) -> None:
    time.sleep(_LATER)
    main = threading.main_thread().ident
    if main is not None:
        # Not to the process: another thread could take it, which would not wake this one from a wait.
        with suppress(ProcessLookupError):
            signal.pthread_kill(main, number)


def _must_go_on(frame: FrameType | None) -> bool:
    """Return whether what a signal interrupted must not be broken off."""
    while frame is not None:
        code = frame.f_code
        if code in _CALLBACKS or (code.co_filename in _BOOKKEEPERS and code.co_name not in _BLOCKING):
            return True
        frame = frame.f_back
    return False
