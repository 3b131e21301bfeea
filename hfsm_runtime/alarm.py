"""Wake sleeping threads one by one, each when its time comes, instead of all at once.

A state that is entered may wake hundreds of automata, whose threads would all fight for the interpreter to
find out that their first cycles are spread over the period.
"""

from __future__ import annotations

import heapq
import threading
from itertools import count
from typing import Final

from .timeline import Timeline

__all__ = ["Alarm"]

_IDLE: Final = 2.0
_END: Final = 1.0
"""The longest wait in wall seconds for the thread to end."""


class Alarm:
    """Sets events at component times in ns, on a thread of its own. Start and stop it once."""

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self._lock = threading.Lock()
        self._due: list[tuple[int, int, threading.Event]] = []
        self._numbers = count()
        self._news = threading.Event()
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="alarm", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread; events that are not due yet are never set."""
        self._stopping = True
        self._news.set()
        if self._thread.ident is not None and self._thread is not threading.current_thread():
            self._thread.join(_END)

    def set_at(self, due: int, event: threading.Event) -> None:
        """Set an event at a time, or at once when it is past."""
        with self._lock:
            first = not self._due or due < self._due[0][0]
            heapq.heappush(self._due, (due, next(self._numbers), event))
        if first:
            self._news.set()

    def look(self) -> None:
        """Look at the time again, which has stood still, or was far from what is due."""
        self._news.set()

    def _run(self) -> None:
        while True:
            self._news.clear()  # before anything is looked at: what changes later sets it again
            if self._stopping:
                return
            due = self._set_due()
            if due is None:
                self._news.wait(_IDLE)
            else:
                self._timeline.wait_until(due, self._news)

    def _set_due(self) -> int | None:
        """Set the events whose time has come; return that of the next, if any."""
        now = self._timeline.now()
        with self._lock:
            while self._due and self._due[0][0] <= now:
                heapq.heappop(self._due)[2].set()
            return self._due[0][0] if self._due else None
