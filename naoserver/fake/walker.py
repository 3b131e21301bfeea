"""A walk without legs: the fake robot glides over the floor exactly as it is commanded."""

from __future__ import annotations

import math
import threading
from typing import Final

from naoserver.capabilities import Odometry, WalkVelocity
from zenoh_ice import Clock

__all__ = ["LIMITS", "FakeWalker"]

LIMITS: Final = WalkVelocity(forward=0.3, left=0.12, turn=0.9)
"""The highest velocity of each kind: those of the simulated robot."""
_STILL: Final = WalkVelocity()


class FakeWalker:
    """Move at the commanded velocity from the moment of the command. Implements Walker."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock = threading.Lock()  # held for microseconds
        self._velocity = _STILL
        self._odometry = Odometry(clock.now(), 0.0, 0.0, 0.0)
        self._closed = False

    @property
    def limits(self) -> WalkVelocity:
        """The highest velocity of each kind, each by itself."""
        return LIMITS

    def command(self, velocity: WalkVelocity) -> None:
        """Move at a velocity until the next command."""
        with self._lock:
            self._go_on()
            if not self._closed:
                self._velocity = velocity

    def commanded(self) -> WalkVelocity:
        """Return the newest command."""
        return self._velocity

    @property
    def walking(self) -> bool:
        """Whether it moves: it stops at once."""
        return self._velocity != _STILL

    def odometry(self) -> Odometry:
        """Return where it is."""
        with self._lock:
            self._go_on()
            return self._odometry

    def close(self) -> None:
        """Stop for good."""
        with self._lock:
            self._go_on()
            self._velocity = _STILL
            self._closed = True

    def _go_on(self) -> None:
        """Move to now: with a constant velocity in its own frame it goes along a part of a circle."""
        before, velocity, now = self._odometry, self._velocity, self._clock.now()
        seconds = max(0.0, now - before.time)
        turned = velocity.turn * seconds
        half = turned / 2.0
        middle = before.heading + half
        chord = seconds * (math.sin(half) / half if half else 1.0)
        cosine, sine = chord * math.cos(middle), chord * math.sin(middle)
        self._odometry = Odometry(
            time=now,
            x=before.x + velocity.forward * cosine - velocity.left * sine,
            y=before.y + velocity.forward * sine + velocity.left * cosine,
            heading=math.pi - (math.pi - before.heading - turned) % (2.0 * math.pi),
        )
