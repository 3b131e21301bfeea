"""Futures of calls whose replies nobody receives yet: they are not left to themselves for long."""

from __future__ import annotations

import threading
import weakref
from typing import Final, Protocol

__all__ = ["Unattended"]

_PATIENCE: Final = 0.25  # s


class Future(Protocol):
    """A future whose reply can be received for it."""

    def attend(self) -> None:
        """Have its reply received, unless somebody does."""


class Unattended:
    """Have the replies received of futures that are kept and not asked within 0.25 to 0.5 s.

    Without that, a servant which replies again and again to one call would fill the channel of the replies,
    and hold up all that comes by the same link, and Zenoh's timer at last.
    """

    def __init__(self, name: str) -> None:
        self._name: Final = name
        self._lock: Final = threading.Lock()
        # All of one turn together: to wake for each would cost calls in flight a fifth of their rate.
        self._futures: list[weakref.ref[Future]] = []
        self._wanted: Final = threading.Event()
        self._thread: threading.Thread | None = None
        self._closed: Final = threading.Event()

    def add(self, future: Future) -> None:
        """Look after a future from now on, for as long as somebody keeps it."""
        self._futures.append(weakref.ref(future))
        if not self._wanted.is_set():
            self._wanted.set()
            if self._thread is None:
                self._start()

    def close(self, timeout: float) -> None:
        """End the thread."""
        with self._lock:
            self._closed.set()
            thread = self._thread
        self._wanted.set()
        if thread is not None and thread is not threading.current_thread():
            thread.join(timeout)

    def _start(self) -> None:
        with self._lock:
            if self._thread is None and not self._closed.is_set():
                thread = threading.Thread(target=self._work, name=f"{self._name} unattended", daemon=True)
                thread.start()  # first: if Ctrl-C strikes here, what was not started must not be waited for
                self._thread = thread

    def _work(self) -> None:
        aged: list[weakref.ref[Future]] = []
        while not self._closed.is_set():
            if not aged:
                self._wanted.wait()
            self._wanted.clear()  # before the look: what is added from now on wakes again
            young, self._futures = self._futures, []
            self._closed.wait(_PATIENCE)
            for reference in aged:
                future = reference()
                if future is not None:
                    future.attend()
                del future  # not kept by who looks after it
            aged = young
