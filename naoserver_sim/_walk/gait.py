"""The gait: one step after the other, each ended by the touch of the swinging foot.

The gait is of the family of rUNSWift's Walk2014 (Hengst, "rUNSWift Walk2014 Report", UNSW 2014): the centre
of mass is not planned, the body rocks from foot to foot by the rhythm in which the feet are lifted, and the
next step begins at the moment when a foot touches down. Feet are given in the torso's frame, so that the
support foot moves backwards under the body as the body moves on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from naoserver.bodies.capabilities import WalkVelocity
from naoserver_sim._locomotion import nearer

LEFT: Final = 0
RIGHT: Final = 1


# The rhythm and the reach of the steps.
PERIOD: Final = 0.25
"""Planned duration of a step in s."""
LIFT: Final = 0.013
"""Height in m to which a foot is lifted."""
EARLIEST_TOUCH: Final = 0.5
"""Part of the period before which no touch of the swinging foot counts."""
LATEST_TOUCH: Final = 1.6
"""Part of the period after which the next step begins without a touch."""
LOWERING: Final = 0.3
"""Part of the period within which a foot that touched early comes down."""
_TOUCH_LOAD: Final = 3.0
"""Load in N from which a foot counts as touching the floor."""
FORWARD_CHANGE: Final = 0.012
"""Largest change of the length of a step from one to the next in m."""
_LEFT_CHANGE: Final = 0.02
"""Largest change of its width in m."""
_TURN_CHANGE: Final = 0.12
"""Largest change of its turn in rad."""
_SLOWING: Final = 4.0
"""Factor by which a step may change more if it becomes smaller: a stop at full speed takes 0.9 s at most."""


@dataclass(frozen=True, slots=True)
class FootOffset:
    """Displacement of a foot from its place at rest, in the torso's frame: m, and rad to the left."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    lift: float = 0.0


AT_REST: Final = FootOffset()
"""A foot next to the other one."""


class Gait:
    """Walk in steps; `tick` is due at each control tick."""

    def __init__(self) -> None:
        self.walking = False
        """True while it makes steps; false when both feet are at rest."""
        self.swing = RIGHT
        """The foot that is in the air."""
        self.steps = 0
        """Number of steps begun."""
        self.phase = 0.0
        """The part of the planned period that has passed, at most 1."""
        self._time = 0.0
        self._step = AT_REST  # what it is for: x forward; y, and yaw to the left in a pair of steps
        self._from = [AT_REST, AT_REST]
        self.feet = [AT_REST, AT_REST]
        """Left and right foot."""

    @property
    def support(self) -> int:
        """The support foot."""
        return 1 - self.swing

    def tick(self, seconds: float, velocity: WalkVelocity, loads: tuple[float, float]) -> bool:
        """Advance by some seconds towards a velocity, by the soles' loads in N; return if a step ended."""
        wanted = self._wanted(velocity)
        if not self.walking:
            if wanted == AT_REST:
                self._lower(seconds)
                return False
            self.walking = True
            self._begin(RIGHT if wanted.y <= 0.0 else LEFT, wanted)
        self._time += seconds
        self.phase = min(self._time / PERIOD, 1.0)
        ended = self._has_ended(loads[self.swing])
        if ended:
            if self._rests(wanted):
                self.stop(*(foot.lift for foot in self.feet))
                return True
            self._begin(self.support, wanted)
        self._move()
        return ended

    def stop(self, left_lift: float = 0.0, right_lift: float = 0.0) -> None:
        """End at once: both feet are at their places at rest, or come down there."""
        self.walking = False
        self.phase = 0.0
        self._step = AT_REST
        self.feet = [FootOffset(lift=left_lift), FootOffset(lift=right_lift)]

    def come_down(self) -> None:
        """End at once: both feet come down where they are, but none ahead of a body that falls back."""
        feet = [replace(foot, x=min(foot.x, 0.0)) for foot in self.feet]
        self.stop()
        self.feet = feet

    def _wanted(self, velocity: WalkVelocity) -> FootOffset:
        # Sideways and when turning, every other step only brings the feet together again.
        return FootOffset(velocity.forward * PERIOD, 2 * velocity.left * PERIOD, 2 * velocity.turn * PERIOD)

    def _has_ended(self, load: float) -> bool:
        late = self._time > LATEST_TOUCH * PERIOD
        return late or (self.phase >= EARLIEST_TOUCH and load > _TOUCH_LOAD)

    def _rests(self, wanted: FootOffset) -> bool:
        """Return whether no motion is wanted and the feet are practically together."""
        if wanted != AT_REST:
            return False
        return all(abs(foot.x) < 0.004 and abs(foot.y) < 0.004 and abs(foot.yaw) < 0.02 for foot in self.feet)

    def _begin(self, swing: int, wanted: FootOffset) -> None:
        self.swing = swing
        self.steps += 1
        self._time = 0.0
        self.phase = 0.0
        self._from = list(self.feet)
        self._step = FootOffset(
            nearer(self._step.x, wanted.x, FORWARD_CHANGE, _SLOWING),
            nearer(self._step.y, wanted.y, _LEFT_CHANGE, _SLOWING),
            nearer(self._step.yaw, wanted.yaw, _TURN_CHANGE, _SLOWING),
        )

    def _move(self) -> None:
        swing = self.swing
        support = self.support
        phase = self.phase
        eased = 0.5 * (1.0 - math.cos(math.pi * phase))
        begun_swing, begun_support = self._from[swing], self._from[support]
        # A foot that touched early is extended down to the actual height of the floor.
        lowered = LIFT * phase / LOWERING
        half = self._step.x / 2
        outwards = 1.0 if swing == LEFT else -1.0
        # Only the foot on the side of a movement can lead it; the other one closes up.
        y = self._step.y / 2 if self._step.y * outwards > 0 else 0.0
        yaw = self._step.yaw / 2 if self._step.yaw * outwards > 0 else 0.0
        self.feet[swing] = FootOffset(
            begun_swing.x + (half - begun_swing.x) * eased,
            begun_swing.y + (y - begun_swing.y) * eased,
            begun_swing.yaw + (yaw - begun_swing.yaw) * eased,
            max(LIFT * 4.0 * phase * (1.0 - phase), begun_swing.lift - lowered),
        )
        self.feet[support] = FootOffset(
            begun_support.x + (-half - begun_support.x) * phase,
            begun_support.y + (-y - begun_support.y) * phase,
            begun_support.yaw + (-yaw - begun_support.yaw) * phase,
            max(begun_support.lift - lowered, 0.0),
        )

    def _lower(self, seconds: float) -> None:
        """Let the feet of a walk that has ended come down."""
        lowered = LIFT * seconds / (LOWERING * PERIOD)
        self.feet = [
            replace(foot, lift=max(foot.lift - lowered, 0.0)) if foot.lift else foot for foot in self.feet
        ]
