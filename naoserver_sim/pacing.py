"""The pace of simulated time: how much of it is due by now, and how well it keeps up."""

from __future__ import annotations

import logging
import math
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

_log = logging.getLogger(__name__)

WINDOW = 1.0
"""Wall seconds over which the real-time factor and the lag are measured."""
SAMPLE_INTERVAL = 0.05
MAX_LAG = 0.25
"""Wall seconds of lag after which the schedule is moved: lost time is not caught up in a burst."""
SHORTEST_WAIT = 0.001
"""Shorter waits cost more than they bring: at a high speed several ticks are due at once instead."""
_ROUNDING = 1e-6
_SLOW, _KEPT = 0.9, 0.97
"""Shares of the speed below which the computer does not keep up, and above which it does again."""
_SLIPS = "the computer does not keep up with speed %g: robot time slips, it runs at %.3g"


class _Sample(NamedTuple):
    wall: float
    simulated: float
    lag: float


class Pacer:
    """Pace simulated time against the steady wall clock.

    The schedule is a straight line from an anchor, so that waits of a wrong length do not add up to a drift.
    `speed` is in simulated seconds a wall second; `math.inf` is as fast as the processor goes.
    """

    def __init__(self, speed: float, wall: Callable[[], float] = time.monotonic) -> None:
        if not speed > 0:
            message = f"the speed is {speed}; give a factor above 0, or 'max'"
            raise ValueError(message)
        self.speed = speed
        self._period = 0.0
        self._wall = wall
        self._anchor_wall = wall()
        self._anchor_simulated = 0.0
        self._samples: deque[_Sample] = deque()
        self._worst = 0.0
        self._slow = False
        self.real_time_factor = 0.0
        """Simulated seconds in a wall second, over the last second."""
        self.lag = 0.0
        """The longest wall time by which a tick of the last second came after its schedule, in s."""
        self.slips = 0
        """Number of shifts of the schedule because the computer did not keep up."""

    def start(self, simulated: float, period: float) -> None:
        """Let the schedule begin now, at the given simulated time, with a tick each `period` s of it."""
        self._period = period
        self._anchor_wall = self._wall()
        self._anchor_simulated = simulated
        self._samples = deque([_Sample(self._anchor_wall, simulated, 0.0)])
        self.real_time_factor = 0.0 if math.isinf(self.speed) else self.speed

    def due(self, simulated: float, limit: int) -> int:
        """Return how many periods are due now, at most `limit`."""
        if math.isinf(self.speed):
            return limit
        late = self._late(simulated)
        if late < 0:
            return 0
        self._worst = max(self._worst, late)
        if late > MAX_LAG:
            self.slips += 1
            self._anchor_wall += late
            return 1
        return min(1 + int(late * self.speed / self._period + _ROUNDING), limit)

    def wait_time(self, simulated: float) -> float:
        """Return the wall seconds to wait before asking again."""
        return max(SHORTEST_WAIT, -self._late(simulated))

    def record(self, simulated: float) -> None:
        """Note the simulated time that was reached, for the real-time factor and the lag."""
        wall = self._wall()
        if wall - self._samples[-1].wall < SAMPLE_INTERVAL:
            return
        self._samples.append(_Sample(wall, simulated, self._worst))
        self._worst = 0.0
        while len(self._samples) > 2 and wall - self._samples[0].wall > WINDOW:
            self._samples.popleft()
        oldest = self._samples[0]
        self.real_time_factor = (simulated - oldest.simulated) / (wall - oldest.wall)
        if len(self._samples) > 2 and wall - oldest.wall > WINDOW / 2 and not math.isinf(self.speed):
            share = self.real_time_factor / self.speed
            if share < _SLOW and not self._slow:
                _log.warning(_SLIPS, self.speed, self.real_time_factor)
            self._slow = share < (_KEPT if self._slow else _SLOW)
        self.lag = max(sample.lag for sample in self._samples)

    def _late(self, simulated: float) -> float:
        """Return the wall seconds since the tick after `simulated` was due; negative before it is."""
        scheduled = (simulated + self._period - self._anchor_simulated) / self.speed
        return self._wall() - self._anchor_wall - scheduled
