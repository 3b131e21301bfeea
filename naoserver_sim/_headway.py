"""Whether a robot gets on: the way that is commanded against the way that its odometry measures."""

from __future__ import annotations

import cmath
import math
from typing import Final

from naoserver.capabilities import Odometry, WalkVelocity

_LAG: Final = 0.8
"""Time constant in s with which a robot follows a higher velocity."""
_SURE: Final = 0.7
"""Part of the way of steady motion from which there is a verdict: not while it starts or turns round."""
_SLOW: Final = 0.05
"""Mean commanded velocity in m/s below which there is no verdict: who turns does not stay on the spot."""
_LEAST: Final = 0.5
"""Least part of the commanded way that a robot goes which gets on."""


class Headway:
    """Add up both ways, as sums that forget; `tick` is due at each control tick of a motion.

    `memory` is the time constant in s with which they forget; `slack` is the distance in m by which the way
    done may be less, because steps differ.
    """

    def __init__(self, memory: float = 2.0, slack: float = 0.04) -> None:
        self._memory = memory
        self._slack = slack
        self.begin()

    def begin(self) -> None:
        """Begin a motion, from rest."""
        self._expected = self._told = self._done = 0j
        self._place: complex | None = None

    def tick(self, seconds: float, velocity: WalkVelocity, now: Odometry) -> bool:
        """Advance by some seconds at a velocity, at the end of which it is `now`; return if it gets on."""
        wanted, place = complex(velocity.forward, velocity.left), complex(now.x, now.y)
        if abs(self._expected) > abs(wanted):  # it slows down sooner
            self._expected *= abs(wanted) / abs(self._expected)
        self._expected += (wanted - self._expected) * seconds / _LAG
        kept = math.exp(-seconds / self._memory)
        self._told = kept * self._told + seconds * self._expected * cmath.rect(1.0, now.heading)
        self._done = kept * self._done + (0j if self._place is None else place - self._place)
        self._place = place
        told = abs(self._told)
        if told < self._memory * max(_SLOW, _SURE * abs(wanted)):
            return True
        return (self._done / self._told).real * told >= _LEAST * told - self._slack
