"""The linear inverted pendulum in a step: where the capture point goes, in closed form.

The body is a point mass at constant height over the zero moment point (Kajita et al., IROS 2001). Its capture
point moves away from that point exponentially (Englsberger et al., IEEE Trans. Robotics 31, 2015). In the
double support at the beginning of a step the zero moment point passes evenly from the old foot to the new
one. Places on the floor are complex numbers, x + iy, in m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pendulum:
    """The pendulum of a body in a step that takes `step_time` s."""

    frequency: float
    """Natural frequency in 1/s."""
    double_support: float
    """In s."""
    step_time: float

    def growth(self, time: float) -> float:
        """Return the growth of a distance from the new foot from a time in s to the step's end."""
        return math.exp(self.frequency * (self.step_time - time))

    def pulled(self, time: float) -> float:
        """Return by how much the rest of load on the old foot moves the end, in ways from old to new foot.

        It is the integral of the zero moment point's way from a time in s to the end of the step.
        """
        if time >= self.double_support:
            return 0.0
        return self._antiderivative(self.double_support) - self._antiderivative(time)

    def end(self, point: complex, time: float, old: complex, new: complex) -> complex:
        """Return where a capture point that is at `point` at a time will be at the step's end."""
        return new + self.growth(time) * (point - new) + self.pulled(time) * (new - old)

    def start(self, end: complex, time: float, old: complex, new: complex) -> complex:
        """Return where the capture point must be at a time to be at `end` at the step's end."""
        return new + (end - new - self.pulled(time) * (new - old)) / self.growth(time)

    def offset(self, width: float, stride: complex) -> complex:
        """Return capture point less new foot at the beginning of each step of a periodic walk.

        `stride` is the way of the body in a step, in the frame of its heading. `width` in m is the distance
        of the old foot from the new one to the left: it is negative when the new one is the left one.
        """
        growth, pulled = self.growth(0.0), self.pulled(0.0)
        return stride * (1.0 - pulled) / (growth - 1.0) + 1j * width * (1.0 + pulled) / (1.0 + growth)

    def _antiderivative(self, time: float) -> float:
        share = time / self.double_support
        return self.growth(time) * (share - 1.0 + 1.0 / (self.frequency * self.double_support))
