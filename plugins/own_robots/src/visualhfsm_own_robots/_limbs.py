"""Which joints of a user's robot are a head, arms, legs, a trunk or wheels: by names, places and shapes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from visualhfsm_own_robots._figure import Figure
from visualhfsm_own_robots._parts import Parts

Kind = Literal["head", "arm", "leg", "wheel", "trunk", ""]
Side = Literal["left", "right", ""]

_WORDS: Final[Mapping[Kind, re.Pattern[str]]] = {
    "leg": re.compile(
        r"(?:\b|left|right)hip\b|knee|ankle|thigh|calf|shank|shin\b|foot|\blegs?\b"
        r"|\b[lr][fhrb] ?h(?:aa|fe)|kfe"
    ),
    "arm": re.compile(
        r"(?:\b|\b[lr]|fore|upper|lower|left|right)arm\b|shoulder|elbow|wrist|hand\b|gripper|finger"
    ),
    "head": re.compile(r"head|neck|gimbal|\bptu\b|\bpan\b|\btilt\b"),
}
"""Words in the names of joints and links, in the order in which they count."""
_HAND: Final = re.compile(r"finger|thumb|gripper|knuckle|palm|index|middle|ring|pinky|little|claw|jaw")
_PARTS: Final = "leg|arm|hip|knee|ankle|foot|hand|shoulder|elbow|wrist|thigh|shank|finger|gripper|wheel"
_SIDES: Final[Mapping[Side, re.Pattern[str]]] = {
    "left": re.compile(rf"left|\b(?:l|[fhrb]l|l[fhrmb])\d*\b|\bl(?:{_PARTS})"),
    "right": re.compile(rf"right|\b(?:r|[fhrb]r|r[fhrmb])\d*\b|\br(?:{_PARTS})"),
}
"""Words that name a side; `lhand` does as well as `l hand`."""
_SMALL: Final = 0.15
"""Size of a finger or an eye beside the robot's, at most."""
_MIDDLE: Final = 0.05
"""Share of the robot's size within which a part is in the middle."""
_SHORT: Final = 3
"""Most joints of a limb that only turns a camera."""
_HORIZONTAL: Final = 0.99
"""Least length of a wheel's axis, of 1, along the floor."""
_ROUND: Final = 0.8
"""Least extent of a wheel in each direction, as a share of its largest."""
_WHOLE: Final = 0.98 * math.tau
"""Least range in rad of a joint that can turn a wheel."""


class Wheel(NamedTuple):
    """A joint that turns something round on the floor."""

    joint: str
    radius: float
    """In m."""
    place: tuple[float, float, float]
    """Of its middle in m."""
    axis: tuple[float, float, float]
    steered: bool


@dataclass(frozen=True)
class Limb:
    """Joints that begin at the trunk, from there outwards."""

    joints: tuple[str, ...]
    kind: Kind
    side: Side
    why: str


class Limbs:
    """The limbs of a robot; a joint without a motor belongs to none."""

    def __init__(self, parts: Parts) -> None:
        self._parts: Final = parts
        self.figure: Final[Figure] = parts.figure
        self._mj: Final = self.figure.mj
        self._names: Final = {joint: name for name, joint in parts.joints.items()}
        self.driven: Final = {joint["name"] for joint in parts.tables["joints"] if joint["max_torque"] > 0.0}
        self._below: Final[dict[int | None, list[int]]] = {}
        for joint in sorted(self._names):
            self._below.setdefault(self._carrier(joint), []).append(joint)
        low, high = self.figure.box
        self.size: Final = max(float((high - low).max()), 1e-3)
        self._trunk: list[int] = []
        self.wheels: Final = [wheel for joint in sorted(self._names) if (wheel := self._wheel(joint))]
        chains = list(self._split(self._below.get(None, [])))
        figure = self.figure
        standing = sum(len(chain) > 1 and figure.stands(*figure.moved(chain[0])) for chain in chains)
        self._on_legs: Final = standing > 1 and not self._trunk_stands()
        self.limbs: Final = [self._limb(chain) for chain in chains]
        if self._trunk:
            names = tuple(self._names[joint] for joint in self._trunk)
            self.limbs.append(Limb(names, "trunk", "", "limbs branch off it"))

    def of(self, kind: str, side: str = "") -> list[Limb]:
        """Return the limbs of a kind, and of a side, if one is given."""
        return [limb for limb in self.limbs if limb.kind == kind and side in ("", limb.side)]

    def groups(self) -> Iterator[tuple[str, tuple[str, ...], str]]:
        """Yield the groups of a body: name, joints and reason; a joint that follows another is in none."""
        leading = self.driven - {pair["follower"] for pair in self._parts.tables["couplings"]}
        for group in ("head", "left_arm", "right_arm", "left_leg", "right_leg", "trunk"):
            side, _, kind = group.rpartition("_")
            found = self.of(kind, side)
            joints = tuple(name for limb in found for name in limb.joints if name in leading)
            if joints:
                many = f"{len(found)} limbs: " if len(found) > 1 else ""
                yield group, joints, many + found[0].why
        taken = {name for limb in self.limbs if limb.kind not in ("wheel", "") for name in limb.joints}
        free = self.driven - taken
        if wheels := tuple(each.joint for each in self.wheels if each.joint in free):
            yield "wheels", wheels, "round, and on the floor"

    def _carrier(self, joint: int) -> int | None:
        """Return the joint before one on the way from the root; None for a first one."""
        body = int(self._mj.jnt_bodyid[joint])
        before = (other for other in self._names if other < joint and body in self.figure.moved(other))
        return max(before, default=None)

    def _all(self, joint: int) -> list[int]:
        """Return a joint and all that follow it."""
        own, moved = self._mj.jnt_bodyid, self.figure.moved(joint)
        return [each for each in sorted(self._names) if each >= joint and int(own[each]) in moved]

    def _split(self, starts: Sequence[int]) -> Iterator[list[int]]:
        """Yield the chains of joints that begin at the trunk, whose own joints are those before its forks."""
        for start in starts:
            chain = [start]
            while len(children := self._below.get(chain[-1], [])) == 1:
                chain.append(children[0])
            if self._forks(chain[-1]):
                self._trunk += chain
                yield from self._split(self._below[chain[-1]])
            else:
                yield self._all(start)

    def _forks(self, joint: int) -> bool:
        """Return whether limbs of both sides, or of two kinds, follow a joint, as shoulders a waist."""
        children = self._below.get(joint, [])
        limbs = [self._all(child) for child in children if self._is_large(child)]
        kinds = {self._named(self._all(child))[0] for child in children}
        return {"left", "right"} <= {self._side(limb) for limb in limbs} or {"head", "arm"} <= kinds

    def _is_large(self, joint: int) -> bool:
        """Return whether what follows a joint is a limb, and no finger or eye."""
        joints = self._all(joint)
        if len(joints) < 2 or all(_HAND.search(self._called(each)[0]) for each in joints):
            return False
        places = self.figure.data.xanchor[joints]
        return float(np.ptp(places, axis=0).max()) > _SMALL * self.size

    def _side(self, joints: Sequence[int]) -> Side:
        """Return the side of a limb: that of its names, or else of its place."""
        names = [name for joint in joints for name in self._called(joint)]
        count = {side: sum(bool(of.search(name)) for name in names) for side, of in _SIDES.items()}
        if count["left"] != count["right"]:
            return max(count, key=lambda side: count[side])
        low, high = self.figure.box
        y = float(np.mean(self.figure.data.xanchor[list(joints), 1]) - (low[1] + high[1]) / 2)
        return "" if abs(y) < _MIDDLE * self.size else "left" if y > 0 else "right"

    def _called(self, joint: int) -> tuple[str, str]:
        """Return the names of a joint and of the body that it moves, as words."""
        return _spelled(self._names[joint]), _spelled(self._mj.body(self._mj.jnt_bodyid[joint]).name)

    def _limb(self, joints: list[int]) -> Limb:
        kind, why = self._kind(joints)
        side = self._side(joints)
        if kind in ("arm", "leg") and not side:
            side, why = "right", f"{why}; it is on neither side"
        names = tuple(self._names[joint] for joint in joints)
        return Limb(names, kind, side, why)

    def _kind(self, joints: list[int]) -> tuple[Kind, str]:
        """Return what a limb is, and why."""
        round_ones = {wheel.joint for wheel in self.wheels} & {self._names[joint] for joint in joints}
        if round_ones and len(joints) <= 2:
            return "wheel", "it turns something round on the floor"
        kind, why = self._named(joints)
        if kind:
            return kind, why
        bodies = self.figure.moved(joints[0])
        if self._on_legs and self.figure.stands(*bodies):
            return "leg", "it stands on the floor"
        seen = {view.link for view in self._parts.views}
        if len(joints) <= _SHORT and any(self._parts.frames[body].link in seen for body in bodies):
            return "head", "it carries a camera"
        moved = [joint for joint in joints if self._names[joint] in self.driven]
        return ("arm", "a chain of joints that stands on nothing") if len(moved) > 1 else ("", "")

    def _named(self, joints: Sequence[int]) -> tuple[Kind, str]:
        """Return what joints are by words in their names, and which; an empty kind without such."""
        names = [name for joint in joints for name in self._called(joint)]
        for kind, word in _WORDS.items():
            if found := [match[0] for name in names if (match := word.search(name))]:
                return kind, f"{', '.join(dict.fromkeys(found))} in its names"
        return "", ""

    def _trunk_stands(self) -> bool:
        """Return whether what no joint moves is on the floor."""
        moved = {body for joint in self._names for body in self.figure.moved(joint)}
        return self.figure.stands(*(body for body in range(1, self._mj.nbody) if body not in moved))

    def _wheel(self, joint: int) -> Wheel | None:
        """Return the wheel that a joint turns; None if it turns something else."""
        mj, data, figure = self._mj, self.figure.data, self.figure
        low, high = mj.jnt_range[joint]
        whole = not mj.jnt_limited[joint] or high - low > _WHOLE
        bodies = self.figure.moved(joint)
        axis, anchor = figure.data.xaxis[joint], data.xanchor[joint]
        level = math.hypot(axis[0], axis[1]) > _HORIZONTAL
        if figure.slides(joint) or not (whole and level and figure.stands(*bodies)):
            return None
        if any(self._names[each] in self.driven for each in self._all(joint)[1:]):
            return None
        points = figure.points(*bodies) - anchor
        ahead = np.cross(axis, (0.0, 0.0, 1.0))
        ahead /= np.linalg.norm(ahead)
        reach = [float((points @ way).max()) for way in (ahead, -ahead, np.array((0.0, 0.0, 1.0)))]
        radius = float(-points[:, 2].min())
        if min(reach) < _ROUND * radius or max(reach) * _ROUND > radius:
            return None
        x, y, z = (anchor + axis * float((points @ axis).min() + (points @ axis).max()) / 2).tolist()
        return Wheel(
            self._names[joint], radius, (x, y, z), tuple(axis.tolist()), self._carrier(joint) is not None
        )


def _spelled(name: str) -> str:
    """Return the words of a name: `l wrist pitch` of LWristPitch and of l_wrist_pitch."""
    apart = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)
    return re.sub(r"[^A-Za-z0-9]+", " ", apart).lower()
