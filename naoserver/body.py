"""The facts of the bodies H25 and H21: joints, links, cameras, postures and anti-collision ranges.

The figures and their sources are in `nao_h25.json` next to this module. Frames: every link's frame is at its
parent joint and is parallel to the torso's when all joints are 0 (x forward, y left, z up).
"""

from __future__ import annotations

import json
from bisect import bisect_left
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from itertools import pairwise
from typing import Any, Final

from msgspec import convert

from naoserver.capabilities import Vector
from naoserver.errors import RobotError
from naoserver.robot import CameraFacts, JointFacts


@dataclass(frozen=True)
class RangeTable:
    """The range of the joint `dependent` at each angle of the joint `independent`, linear between rows."""

    independent: str
    dependent: str
    rows: tuple[tuple[float, float, float], ...]
    """Angle of `independent`, then lower and upper limit of `dependent`, in rad, by increasing angle."""

    def __post_init__(self) -> None:
        if not self.rows:
            raise RobotError(f"range table of {self.dependent}: no rows")
        for before, after in pairwise(self.rows):
            if not before[0] < after[0]:
                raise RobotError(f"range table of {self.dependent}: angle {after[0]} does not increase")
        for angle, lower, upper in self.rows:
            if lower > upper:
                raise RobotError(f"range table of {self.dependent}: empty range at {angle} rad")

    @cached_property
    def steepest(self) -> float:
        """Largest change of a limit of `dependent` per rad of `independent`."""
        slopes = (
            max(abs(after[1] - before[1]), abs(after[2] - before[2])) / (after[0] - before[0])
            for before, after in pairwise(self.rows)
        )
        return max(slopes, default=0.0)

    def at(self, angle: float) -> tuple[float, float]:
        """Return the range of `dependent` at `angle` of `independent`; beyond the table, that at its edge."""
        rows = self.rows
        place = bisect_left(rows, (angle,))
        if place == 0:
            return rows[0][1:]
        if place == len(rows):
            return rows[-1][1:]
        left, right = rows[place - 1], rows[place]
        share = (angle - left[0]) / (right[0] - left[0])
        return left[1] + share * (right[1] - left[1]), left[2] + share * (right[2] - left[2])

    def over(self, angles: Sequence[float]) -> tuple[float, float]:
        """Return the range that is allowed everywhere between the least and the greatest of `angles`.

        The range is piecewise linear, so its narrowest points lie at the ends and at the rows between.
        """
        first, last = min(angles), max(angles)
        ranges = [self.at(first), self.at(last)]
        ranges += [row[1:] for row in self.rows if first < row[0] < last]
        return max(lower for lower, _ in ranges), min(upper for _, upper in ranges)


@dataclass(frozen=True, slots=True)
class Joint(JointFacts):
    """A joint of the body with its place in the tree of links."""

    parent: str
    """Link that carries the joint."""
    child: str
    """Link that the joint moves."""
    axis: Vector
    """Unit vector in the parent's frame; a positive angle is right-handed about it."""
    origin: Vector
    """Place in the parent's frame in m."""


@dataclass(frozen=True, slots=True)
class Inertia:
    """Moments and products of inertia about the centre of mass in link axes in kg m^2."""

    ixx: float = 0.0
    ixy: float = 0.0
    ixz: float = 0.0
    iyy: float = 0.0
    iyz: float = 0.0
    izz: float = 0.0


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid part of the body."""

    name: str
    parent_joint: str | None
    """Joint that moves it; None for the torso."""
    mass: float
    """In kg; 0 for the fingers, whose mass is included in the hand's."""
    com: Vector
    """Centre of mass in m."""
    inertia: Inertia = Inertia()


@dataclass(frozen=True, slots=True)
class Coupling:
    """Two joints that one motor drives: their angles are always equal, and the leader's command wins."""

    leader: str
    follower: str


VOLTAGE: Final = 21.6
"""Nominal voltage of the battery in V: six cells of 3.6 V."""


class Body:
    """A humanoid body, as described by a facts file."""

    def __init__(self, name: str, facts: Mapping[str, Any]) -> None:
        self.name: Final = name
        """The manufacturer's name for it, such as `H25`."""
        self.facts: Final = facts
        """The whole file: also soles, pressure, inertial, sonar and touch sensors, collision shapes."""
        self.joints: Final = convert(facts["joints"], tuple[Joint, ...])
        """The joints in the order of every reading."""
        self.fixed_joints: Final = convert(facts.get("fixed_joints", ()), tuple[Joint, ...])
        """Places where a link is fixed to another, at the angle 0."""
        self.joint_names: Final = tuple(joint.name for joint in self.joints)
        self.links: Final = convert(facts["links"], tuple[Link, ...])
        """The rigid parts, the torso first, each after the link that carries it."""
        self.anticollision: Final = convert([*facts["anticollision"].values()], tuple[RangeTable, ...])
        """The ranges that keep the head off the shoulders and the feet off each other."""
        self.couplings: Final = (convert(facts["coupling"], Coupling),)
        """The pairs of joints that one motor drives: the two HipYawPitch joints, the left one leading."""
        self.postures: Final = convert(facts["postures"], dict[str, dict[str, float]])
        """NAOqi's postures by name (`STAND`, `STAND_INIT`, `CROUCH`, ...): an angle in rad for each joint."""
        self.cameras: Final = convert(facts["cameras"]["served"], tuple[CameraFacts, ...])
        """The head's cameras, the top one first."""
        self.touch_sensors: Final = tuple(facts["touch"])
        """The names of the touch sensors: the button on the chest, then head, hands and bumpers."""
        motors = [joint.get("motor") for joint in facts["joints"]]
        self._currents = [motor["no_load_speed_out"] / VOLTAGE if motor else 0.0 for motor in motors]

    def motor_currents(self, torques: Sequence[float]) -> list[float]:
        """Return the unsigned current in A with which each joint's motor gives a torque in N m.

        A motor that turns at its no-load speed induces the voltage, so the ratio of both is that of the
        torque to the current, too. It is 0 for a joint without facts of its motor.
        """
        return [abs(torque) * ratio for torque, ratio in zip(torques, self._currents, strict=True)]

    def without(self, name: str, joints: Collection[str], touch: Collection[str]) -> Body:
        """Return a copy called `name`: some joints are fixed at the angle 0, some touch sensors missing."""
        facts = self.facts
        postures = {
            posture: {joint: angle for joint, angle in angles.items() if joint not in joints}
            for posture, angles in facts["postures"].items()
        }
        return Body(
            name,
            {
                **facts,
                "joints": [joint for joint in facts["joints"] if joint["name"] not in joints],
                "fixed_joints": [joint for joint in facts["joints"] if joint["name"] in joints],
                "postures": postures,
                "touch": {sensor: place for sensor, place in facts["touch"].items() if sensor not in touch},
            },
        )


H25: Final = Body("H25", json.loads(resources.files("naoserver").joinpath("nao_h25.json").read_bytes()))
H21: Final = H25.without(
    "H21",
    ("LWristYaw", "RWristYaw", "LHand", "RHand"),
    [name for name in H25.touch_sensors if name[1:].startswith("Hand")],
)
"""The H25 with hands that do not move and feel nothing."""
BODIES: Final = {body.name: body for body in (H25, H21)}


def find_body(name: str) -> Body:
    """Return a body by its name. Raises RobotError when there is no such body."""
    try:
        return BODIES[name]
    except KeyError:
        raise RobotError(f"there is no body {name[:40]!r}; there are {', '.join(BODIES)}") from None
