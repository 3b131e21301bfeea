"""The facts of the H25 body: joints, links, cameras, postures and what keeps its parts apart.

The figures stand with their sources in `nao_h25.json` beside this module. Frames: every link's frame sits at
its parent joint and is parallel to the torso's when all joints are 0 (x forward, y left, z up).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from itertools import pairwise
from types import MappingProxyType
from typing import Any, Final, cast

from naoserver.errors import RobotError
from naoserver.robot import CameraFacts, JointFacts


@dataclass(frozen=True, slots=True)
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

    @property
    def steepest(self) -> float:
        """How far a limit of `dependent` moves at most for each rad of `independent`."""
        return max(
            (
                max(abs(after[1] - before[1]), abs(after[2] - before[2])) / (after[0] - before[0])
                for before, after in pairwise(self.rows)
            ),
            default=0.0,
        )

    def at(self, angle: float) -> tuple[float, float]:
        """Return the range of `dependent` at `angle` of `independent`; beyond the table, that of its edge."""
        rows = self.rows
        if angle <= rows[0][0]:
            return rows[0][1:]
        for left, right in pairwise(rows):
            if angle <= right[0]:
                share = (angle - left[0]) / (right[0] - left[0])
                return left[1] + share * (right[1] - left[1]), left[2] + share * (right[2] - left[2])
        return rows[-1][1:]

    def over(self, angles: Sequence[float]) -> tuple[float, float]:
        """Return the range that is allowed everywhere between the least and the greatest of `angles`.

        The range is piecewise linear, so its narrowest points lie at the ends and at the rows between.
        """
        first, last = min(angles), max(angles)
        ranges = [self.at(first), self.at(last)]
        ranges += [row[1:] for row in self.rows if first < row[0] < last]
        return max(lower for lower, _ in ranges), min(upper for _, upper in ranges)


Vector = tuple[float, float, float]


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
    """Joint that moves it; None of the torso."""
    mass: float
    """In kg; 0 of the fingers, whose mass the hand includes."""
    com: Vector
    """Centre of mass in m."""
    inertia: Inertia


@dataclass(frozen=True, slots=True)
class Coupling:
    """Two joints that one motor drives: their angles are always equal, and the leader's command wins."""

    leader: str
    follower: str


class Body:
    """A humanoid body as its facts file describes it."""

    def __init__(self, facts: Mapping[str, Any], name: str) -> None:
        self.facts: Final[Mapping[str, Any]] = MappingProxyType(dict(facts))
        """The whole file: also soles, pressure, inertial, sonar and touch sensors, collision shapes."""
        self._name = name

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """The joints in the order of every reading."""
        return tuple(
            Joint(
                name=joint["name"],
                lower=float(joint["limits"][0]),
                upper=float(joint["limits"][1]),
                max_velocity=float(joint["max_velocity"]),
                max_torque=float(joint["max_torque"]),
                parent=joint["parent"],
                child=joint["child"],
                axis=_vector(joint["axis"]),
                origin=_vector(joint["origin_xyz"]),
            )
            for joint in self._section("joints")
        )

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """The names of `joints`, in their order."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """The rigid parts, the torso first, each after the link that carries it."""
        return tuple(
            Link(
                name=link["name"],
                parent_joint=link["parent_joint"],
                mass=float(link["mass"]),
                com=_vector(link["com"]),
                inertia=Inertia(**{key: float(v) for key, v in link.get("inertia_com", {}).items()}),
            )
            for link in self._section("links")
        )

    @cached_property
    def cameras(self) -> tuple[CameraFacts, ...]:
        """The head's cameras: the top one, served as `Camera`, and `CameraBottom`."""
        facts = self._section("cameras")
        model = facts["v6"]
        return tuple(
            CameraFacts(
                name=name,
                position=_vector(facts[place]["position"]),
                tilt=float(facts[place]["rpy"][1]),
                horizontal_fov=math.radians(model["hfov_deg"]),
                sizes=tuple((width, height) for width, height, _ in model["modes"][place]),
                rates=tuple(float(rate) for _, _, rate in model["modes"][place]),
            )
            for name, place in (("Camera", "top"), ("CameraBottom", "bottom"))
        )

    @cached_property
    def touch_sensors(self) -> tuple[str, ...]:
        """The names of the touch sensors: the button on the chest, then head, hands and bumpers."""
        facts = self._section("touch")
        return (
            "ChestButton",
            *(f"Head{place}" for place in facts["head"]),
            *(f"{side}Hand{place}" for side in "LR" for place in facts["hand_left"]),
            *(f"LFootBumper{edge}" for edge in facts["bumpers_left_foot"]),
            *(f"RFootBumper{edge}" for edge in facts["bumpers_right_foot"]),
        )

    @cached_property
    def anticollision(self) -> tuple[RangeTable, ...]:
        """The ranges that keep the head off the shoulders and the feet off each other."""
        tables = []
        for table in self._section("anticollision").values():
            independent, lowest, _ = table["columns"]
            rows = tuple(_vector(row) for row in table["rows"])
            tables.append(RangeTable(independent, lowest.removesuffix("_min"), rows))
        return tuple(tables)

    @cached_property
    def couplings(self) -> tuple[Coupling, ...]:
        """The pairs of joints that one motor drives: the two HipYawPitch joints, the left one leading."""
        leader, follower = self._section("coupling")["joints"]
        return (Coupling(leader, follower),)

    @cached_property
    def postures(self) -> Mapping[str, Mapping[str, float]]:
        """NAOqi's postures by name (`STAND`, `STAND_INIT`, `CROUCH`, ...): an angle in rad for each joint."""
        section = self._section("postures")
        return MappingProxyType(
            {
                name: MappingProxyType({joint: float(angle) for joint, angle in angles.items()})
                for name, angles in section.items()
                if isinstance(angles, Mapping)
            }
        )

    def _section(self, key: str) -> Any:  # noqa: ANN401  (a part of a JSON document)
        try:
            return self.facts[key]
        except KeyError:
            raise RobotError(f"{self._name}: there is no section {key!r}") from None


def load_body(name: str = "nao_h25.json") -> Body:
    """Return the body whose facts file `name` stands in this package."""
    text = resources.files("naoserver").joinpath(name).read_text(encoding="utf-8")
    return Body(json.loads(text), name)


def _vector(values: object) -> Vector:
    x, y, z = cast("list[float]", values)
    return float(x), float(y), float(z)


H25: Final = load_body()
