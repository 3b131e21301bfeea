"""Where calls arrive: a bounded queue of Zenoh's, and the threads that take them out of it."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from typing import Final

import zenoh
from zenoh.handlers import RingChannel

from ..dispatch import mark_thread

__all__ = ["MAX_WAITING", "QueryInbox"]

MAX_WAITING: Final = 64
"""How many calls of a servant wait at most."""

# s for which it is told that the queue was full: whose call fell out of it asks within milliseconds.
_CROWDED_NOTICE: Final = 1.0

_logger = logging.getLogger(__name__)


class QueryInbox:
    """Take the calls of a key expression on `width` threads of its own.

    `answer` is given each query, and a moment of the monotonic clock before which it had not come. The query
    is its own then: one that is neither answered nor dropped hangs its client until the timeout.
    """

    def __init__(self, name: str, answer: Callable[[zenoh.Query, float], None], *, width: int = 1) -> None:
        self._name: Final = name
        self._answer: Final = answer
        self._resting: Final = [True] * width
        self._taken = 0
        self._empty_at = time.monotonic()
        self._crowded = (-math.inf, -math.inf)
        self._queryable: zenoh.Queryable[zenoh.Handler[zenoh.Query]] | None = None
        self._threads: list[threading.Thread] = []

    def open(self, session: zenoh.Session, key: str, *, complete: bool) -> None:
        """Take calls from now on."""
        # A ring: a queue that is full would hold up everything that the session receives. The oldest calls
        # fall out of it; their clients get no answer, from which they know. Our own threads take the calls
        # out, which needs neither code of ours on Zenoh's thread nor another hop to a pool: both cost a small
        # call some 20 us each. Complete: where several are, one gets the call, not all.
        self._queryable = session.declare_queryable(key, RingChannel(MAX_WAITING), complete=complete)
        for number in range(len(self._resting)):
            thread = threading.Thread(
                target=self._serve,
                args=(self._queryable.handler, number),
                name=self._name + (f" {number + 1}" if number else ""),
                daemon=True,
            )
            thread.start()  # first: if Ctrl-C strikes here, what was not started must not be waited for
            self._threads.append(thread)

    def close(self) -> None:
        """Take no more calls; those that wait end without an answer, and the threads with what they do."""
        if self._queryable is not None:
            self._queryable.undeclare()
            self._queryable = None

    def join(self, deadline: float) -> bool:
        """Wait for the threads, except the current one, until a moment; return whether they ended."""
        ended = True
        while self._threads:
            thread = self._threads.pop()
            if thread is not threading.current_thread():
                thread.join(max(0.0, deadline - time.monotonic()))
                ended = ended and not thread.is_alive()
        return ended

    def busy_for(self) -> float:
        """Return for how many s calls may have fallen out of the queue, up to now; 0 when none did."""
        now = time.monotonic()
        if not any(self._resting):
            return now - self._empty_at
        began, ended = self._crowded
        return now - began if now - ended < _CROWDED_NOTICE else 0.0

    def crowded_ago(self) -> float:
        """Return how many s ago a call may last have fallen out of the queue; infinite when none ever did."""
        return time.monotonic() - self._crowded[1] if any(self._resting) else 0.0

    def _serve(self, handler: zenoh.Handler[zenoh.Query], number: int) -> None:
        mark_thread()
        resting, answer = self._resting, self._answer
        waiting_since = time.monotonic()
        while True:
            try:
                query = handler.try_recv()
                if query is None:
                    if self._taken >= MAX_WAITING:
                        # After a call fell out of the full queue, those in it are taken out without a pause.
                        self._crowded = (self._empty_at, time.monotonic())
                    self._taken = 0
                    resting[number] = True
                    query = handler.recv()
                    resting[number] = False
                    # Nobody waited before it, so who waits came later.
                    self._empty_at = waiting_since = time.monotonic()
            except zenoh.ZError:  # the queryable was undeclared
                return
            self._taken += 1
            try:
                answer(query, waiting_since)
            except BaseException:
                _logger.exception("internal error in %s", threading.current_thread().name)
            del query  # not held while the next is waited for: its client would hang
