"""The simulated time as a clock."""

from __future__ import annotations

import threading
import time
from typing import Final

from naoserver_sim.simulator import PacedSimulator

_SHORTEST: Final = 0.0005
_LONGEST: Final = 0.05


class SimulationClock:
    """The time of a simulator that keeps its own pace; it moves on with each control tick."""

    simulated: Final = True

    def __init__(self, simulator: PacedSimulator) -> None:
        self._simulator = simulator

    @property
    def rate(self) -> float:
        """Simulated seconds in a second of wall time, over the last second; 0 when it stands still."""
        return self._simulator.real_time_factor

    def now(self) -> float:
        """Return the seconds since the start of the simulation."""
        return self._simulator.newest().time

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s; returns early when the simulation ends."""
        self.sleep_until(self.now() + seconds)

    def sleep_until(self, when: float) -> None:
        """Wait until the clock shows `when`; returns early when the simulation ends."""
        while self._simulator.running and (left := when - self.now()) > 0:
            time.sleep(self._nap(left))

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s of simulated time; return whether it is set."""
        end = self.now() + timeout
        while self._simulator.running and (left := end - self.now()) > 0:
            if event.wait(self._nap(left)):
                return True
        return event.is_set()

    def _nap(self, left: float) -> float:
        """Return how long to sleep on the wall before looking at the time again."""
        return min(max(left / max(self.rate, 1e-3), _SHORTEST), _LONGEST)
