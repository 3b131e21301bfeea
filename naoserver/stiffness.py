"""How strongly motors hold, changed little by little: a robot that goes limp at once falls hard."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

__all__ = ["StiffnessRamps"]


@dataclass(frozen=True, slots=True)
class _Ramp:
    """A change from `start` on: from one value to another within some seconds."""

    start: float
    seconds: float
    before: float
    after: float

    def at(self, time: float) -> float:
        left = self.start + self.seconds - time
        if left <= 0.0:
            return self.after
        return self.after + (self.before - self.after) * min(1.0, left / self.seconds)


class StiffnessRamps:
    """The stiffness of each motor over robot time, 1 at first. Safe to use from any thread."""

    def __init__(self, motors: Sequence[str]) -> None:
        self._lock = threading.Lock()
        self._ramps = {motor: _Ramp(0.0, 0.0, 1.0, 1.0) for motor in motors}

    def command(self, stiffnesses: Mapping[str, float], seconds: float, now: float) -> None:
        """Change some motors within some seconds from `now` on. Raises KeyError for an unknown one."""
        with self._lock:
            for motor, value in stiffnesses.items():
                self._ramps[motor] = _Ramp(now, seconds, self._ramps[motor].at(now), value)

    def at(self, time: float) -> tuple[float, ...]:
        """Return the stiffness of every motor, in the order in which they were given."""
        with self._lock:
            return tuple(ramp.at(time) for ramp in self._ramps.values())

    def limp_since(self, time: float) -> dict[str, float]:
        """Return the motors that are limp at a time, and since when."""
        with self._lock:
            ends = {motor: ramp.start + ramp.seconds for motor, ramp in self._ramps.items() if not ramp.after}
        return {motor: end for motor, end in ends.items() if end <= time}
