"""Starting and ending threads, and the pulse of a process."""

from __future__ import annotations

import atexit
import logging
import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Final

from zenoh_ice.data.exceptions import BusyException

PULSE_PERIOD: Final = 0.02  # s between checks of the threads and of the clock

_STANDSTILL: Final = 0.5  # s without a beat: more than a busy machine makes of the period
_AFTERMATH: Final = 1.0  # s until all that waited has been read

# The clock that runs while the machine is suspended, where the system has one.
_CLOCK: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)

_logger = logging.getLogger(__name__)
_awaited: Final[list[threading.Thread]] = []
_END_LIMIT: Final = 15.0  # s; Zenoh closes a session within 10 s


class UserCodeThread(threading.Thread):
    """A thread of a communicator that runs user code."""


def start(thread: threading.Thread) -> None:
    """Start a thread; raises BusyException where the system gives this process no more."""
    try:
        thread.start()
    except RuntimeError as error:
        raise BusyException(no_thread(error)) from error


def no_thread(error: RuntimeError | None) -> str:
    """Return why no further thread could be started, and what to do."""
    return f"{error}: raise the process's limit of threads (ulimit -u, TasksMax=, pids.max) or of memory"


class Pulse:
    """Notice from missing beats that the process stood still.

    A process that was stopped (SIGSTOP, a debugger, a suspended machine) finds calls in the system's buffers
    whose callers gave up long ago. They look as if they had just arrived; only this class knows better.
    """

    def __init__(self) -> None:
        self.running_since = time.monotonic()
        """Data received now arrived after this moment of the monotonic clock, usually within 0.1 s."""
        self._last = math.inf
        self._doubtful_until = 0.0

    def beat(self) -> None:
        """Note that the process runs; to be called every PULSE_PERIOD s."""
        moment = time.clock_gettime(_CLOCK)
        pause, self._last = moment - self._last, moment
        if pause > _STANDSTILL:
            _logger.info("this process stood still for %.1f s", pause)
            self.running_since = time.monotonic() - pause
            self._doubtful_until = moment + _AFTERMATH
        elif moment >= self._doubtful_until:
            self.running_since = time.monotonic()


def repeat(period: float, job: Callable[[], object], name: str) -> Callable[[], object]:
    """Run a job every `period` s on a thread, also after it failed; return a function that ends it.

    Raises BusyException as `start` does.
    """
    end = threading.Event()

    def run() -> None:
        while not end.wait(period):
            try:
                job()
            except Exception:
                _logger.exception("internal error in %s", name)

    thread = threading.Thread(target=run, name=name, daemon=True)
    start(thread)

    def close() -> None:
        end.set()
        join([thread], 2.0)

    return close


def await_at_exit(thread: threading.Thread) -> None:
    """Let the end of the process wait for a thread that is inside a library of Rust or C++.

    The end of the interpreter would tear it off there, which such a library answers by SIGABRT.
    """
    _awaited[:] = [each for each in (*_awaited, thread) if each.is_alive()]


@atexit.register
def _wait_for_libraries() -> None:
    deadline = time.monotonic() + _END_LIMIT
    for thread in _awaited:
        thread.join(max(0.0, deadline - time.monotonic()))


def join(threads: Sequence[threading.Thread], timeout: float) -> bool:
    """Wait for the end of threads, but not of the current one; return whether they ended, or log an error."""
    deadline = time.monotonic() + timeout
    others = [thread for thread in threads if thread is not threading.current_thread()]
    for thread in others:
        thread.join(max(0.0, deadline - time.monotonic()))
    busy = [thread.name for thread in others if thread.is_alive()]
    if busy:
        _logger.error("%s still busy after %g s", ", ".join(busy), timeout)
    return not busy
