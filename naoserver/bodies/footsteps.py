"""The parameters of a walk by footsteps: for bodies on two legs of six joints each, which hold angles."""

from __future__ import annotations

import math
from dataclasses import astuple
from typing import Final

import msgspec

from naoserver.bodies.capabilities import Vector, WalkVelocity
from naoserver.errors import RobotError

GRAVITY: Final = 9.81
"""In m/s2."""


class Footsteps(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="footsteps", tag_field="kind"
):
    """How a body stands, walks and keeps its balance by footsteps.

    Raises RobotError when a figure is not possible.
    """

    com_height: float
    """Height of the center of mass over the soles in m: with bent knees, so that the legs can reach."""
    width: float
    """Distance in m between the middles of the soles of a robot that stands or walks straight on."""
    sole_middle: Vector
    """The middle of a sole in the frame of its foot, in m."""
    sole_half: tuple[float, float]
    """Half the length and half the width in m of the part of a sole on which it can stand."""
    lift: float
    """Height in m to which a foot is lifted."""
    limits: WalkVelocity
    """The highest velocity of each kind."""
    backward: float = 0.25
    """The highest velocity backwards in m/s."""
    changes: WalkVelocity = WalkVelocity(0.12, 0.08, 0.3)
    """By how much each can change from one step to the next, twice as much when it becomes smaller."""
    step_time: float = 0.45
    """Seconds of a step."""
    double_support: float = 0.06
    """Seconds at the beginning of a step in which the weight passes from one foot to the other."""
    shortest_step: float = 0.28
    """Seconds of a step that a push makes earlier."""
    reach: float = 0.4
    """Longest step of a foot beyond the other one, forwards and backwards, in m."""
    narrowest: float = 0.12
    """Least distance sideways in m between the feet: they do not cross."""
    widest: float = 0.44
    """Largest distance sideways in m between the feet."""
    pull: float = 0.1
    """Part of its distance from the measured center of mass that the planned one makes up for in a tick."""
    standing_gain: float = 0.8
    """How far the zero moment point of a robot on both feet goes beyond the capture point, as a part of the
    distance of that point from the middle."""
    walking_gain: float = 1.0
    """The same in a step, as a part of the distance from the planned capture point."""
    place_gain: float = 1.0
    """Gain in 1/s with which steps make up for the distance from the commanded way."""
    acceleration_share: float = 0.5
    """Part of the planned accelerations that the torques account for. With all of it the contact of the soles
    is not good enough on smooth floors, with none of it the trunk sways."""
    arm_swing: float = 3.0
    """Radians of a hanging arm for a metre by which the foot on the other side is ahead of the middle."""

    source: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        """Refuse figures with which nobody can walk. Raises RobotError."""
        for name in ("com_height", "lift", "double_support", "reach", "narrowest", "backward"):
            self._require(name, 0.0, math.inf)
        for name in ("standing_gain", "walking_gain", "place_gain", "arm_swing"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise RobotError(f"footsteps: {name} is {getattr(self, name)}: it must not be negative")
        self._require("pull", 0.0, 1.0)
        self._require("acceleration_share", 0.0, 1.0)
        self._require("step_time", self.double_support, 2.0)
        self._require("shortest_step", self.double_support, self.step_time)
        self._require("width", self.narrowest, self.widest)
        if not all(math.isfinite(value) for value in self.sole_middle):
            raise RobotError(f"footsteps: sole_middle is {self.sole_middle}: it must be finite")
        if not all(0.0 < value < math.inf for value in self.sole_half):
            raise RobotError(f"footsteps: sole_half is {self.sole_half}: both must be above 0")
        if not all(0.0 <= value < math.inf for value in astuple(self.limits)):
            raise RobotError(f"footsteps: limits are {self.limits}: none may be negative")

    def _require(self, name: str, above: float, most: float) -> None:
        value = getattr(self, name)
        if not (above < value <= most and math.isfinite(value)):
            limits = f"above {above:g}" if math.isinf(most) else f"above {above:g}, and {most:g} at most"
            raise RobotError(f"footsteps: {name} is {value}: it must be {limits}")

    def possible(self, wanted: WalkVelocity) -> WalkVelocity:
        """Return a velocity in the same direction at which it can walk.

        The highest velocities are those of one kind without the others: all together have one step to share.
        """
        limits = self.limits
        highest = limits.forward if wanted.forward >= 0.0 else self.backward
        parts = (
            (wanted.forward, highest),
            (wanted.left, limits.left),
            (wanted.turn, limits.turn),
        )
        effort = sum(abs(value) / most for value, most in parts if most > 0.0)
        part = 1.0 / max(effort, 1.0)
        return WalkVelocity(*(part * value if most > 0.0 else 0.0 for value, most in parts))

    @property
    def frequency(self) -> float:
        """Natural frequency in 1/s of the linear inverted pendulum that the body is."""
        return math.sqrt(GRAVITY / self.com_height)
