"""Who listens to a stream of large values through channels, at its servant's process."""

from __future__ import annotations

import math
import threading
import time
from typing import Final, Protocol

from zenoh_ice.carriers._local.memory import Arena
from zenoh_ice.carriers._local.messages import LARGEST_INLINE, SAMPLE, encode, lend
from zenoh_ice.data.codec import Pieces
from zenoh_ice.threads.limits import LIMITS, Limits

_MOST_LENT: Final = 8  # samples that a listener may leave unread in the memory of their sender
_MOST_LISTENERS: Final = 256  # others listen over the network
_ON_THEIR_WAY: Final = 3  # more of them that it has received, or that were sent to it, but not given back
_SHORTAGE: Final = 0.5  # s without memory after which listeners are sent to the network
_REFUSAL: Final = 5.0  # s for which they stay there


def most_unread(size: int, limits: Limits = LIMITS) -> int:
    """Return how many samples of a size in bytes a listener may leave unread in lent memory."""
    return max(1, min(_MOST_LENT, limits.unread_bytes // max(1, size)))


class Listener(Protocol):
    """A channel that carries samples."""

    def send_sample(self, message: bytes) -> bool:
        """Send a sample, or drop it rather than wait; return whether there was room for it."""

    def close(self) -> None:
        """End it: its client then listens elsewhere."""


class Listeners:
    """Send samples to all listeners; each is written into memory once, for all of them. Thread-safe."""

    def __init__(self, arena: Arena, limits: Limits = LIMITS) -> None:
        self._limits: Final = limits
        self._arena: Final = arena
        self._lock: Final = threading.Lock()
        self._all: tuple[Listener, ...] = ()
        self._refused_until = -math.inf
        self._short_since = math.inf  # of memory

    def __bool__(self) -> bool:
        return bool(self._all)

    def add(self, listener: Listener) -> bool:
        """Send it samples from now on; return false when there will be none."""
        with self._lock:
            if time.monotonic() < self._refused_until or len(self._all) >= _MOST_LISTENERS:
                return False
            self._all = (*self._all, listener)
            return True

    def remove(self, listener: Listener) -> None:
        """Send it no further samples."""
        with self._lock:
            self._all = tuple(each for each in self._all if each is not listener)

    def put(self, payload: bytes | Pieces, attachment: bytes) -> None:
        """Send a sample; listeners that have not read several before do not get it."""
        most = most_unread(len(payload), self._limits) + _ON_THEIR_WAY
        ready = [each for each in self._all if self._arena.lent_to(each) < most]
        if not ready:
            time.sleep(0)  # a turn for the thread that learns what was given back
            return
        small, places, extent = lend(payload, self._arena, *ready)
        if len(small) > LARGEST_INLINE:
            self._note_shortage()
            return
        self._short_since = math.inf
        message = encode((SAMPLE, attachment, small, *(() if extent is None else (places, extent))))
        for listener in ready:
            if not listener.send_sample(message) and extent is not None:
                self._arena.give_back(extent.start, listener)

    def close(self, refusal: float = math.inf) -> None:
        """Send all listeners elsewhere, and take none for some s."""
        with self._lock:
            self._refused_until = time.monotonic() + refusal
            ended, self._all = self._all, ()
        for listener in ended:
            listener.close()

    def _note_shortage(self) -> None:
        """Send listeners to the network when there has been no memory for them for some time."""
        now = time.monotonic()
        self._short_since = min(self._short_since, now)
        if now - self._short_since >= _SHORTAGE:
            self.close(_REFUSAL)
