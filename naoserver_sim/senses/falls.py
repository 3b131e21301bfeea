"""The fall manager: a robot that falls lets its motors go, so that they give way when it hits the floor.

So does the real one. NAOqi watches for falls while the robot stands on its feet, not while it sits, lies or
is lifted; nor does it after a fall, until the robot stands again. The motors stay limp until they are
commanded to be stiff.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Final

_log = logging.getLogger(__name__)

FALLING_TILT: Final = math.radians(35)
"""Tilt of the torso from which on there is no way back when it goes on tilting."""
FALLING_RATE: Final = 0.8
"""Rate in rad/s at which a tilt grows in a fall, not in a motion that bends or lies down."""
LIMP_WITHIN: Final = 0.1
"""Seconds in which the motors let go."""
_UPRIGHT: Final = math.radians(15)
"""Greatest tilt at which the robot stands."""
_STANDING_LOAD: Final = 25.0
"""Least load on the soles in N with which it stands: half its weight."""
_HEELS: Final = 15.0
"""Load on the soles in N below which it is off its feet: heels that lie on the floor carry less."""
_STANDING_TIME: Final = 0.5
"""Seconds for which it has to stand to be watched, and to be off its feet to be so no more."""


class FallManager:
    """Watch the tilt and the feet at each tick, and let go once in a fall; in the thread of the physics."""

    def __init__(self, let_go: Callable[[float], None]) -> None:
        self._let_go = let_go
        self._tilt = 0.0
        self._stood = 0.0
        self._off_feet = 0.0
        self.watching = False
        """Whether a fall would be noticed."""
        self.falls = 0
        """Falls noticed so far."""

    def look(self, time: float, seconds: float, tilt: float, load: float) -> None:
        """Look at the angle between the torso and the vertical in rad, and at the load on the soles in N.

        `seconds` have passed since the last look.
        """
        rate, self._tilt = (tilt - self._tilt) / seconds, tilt
        on_feet = load >= _STANDING_LOAD
        self._off_feet = 0.0 if load >= _HEELS else self._off_feet + seconds
        self._stood = self._stood + seconds if on_feet and tilt < _UPRIGHT else 0.0
        if self._stood >= _STANDING_TIME:
            self.watching = True
        elif self._off_feet >= _STANDING_TIME:
            self.watching = False
        if self.watching and tilt > FALLING_TILT and rate > FALLING_RATE:
            self.watching = False
            self.falls += 1
            _log.warning("the robot falls at %.2f s: its motors let go", time)
            self._let_go(LIMP_WITHIN)
