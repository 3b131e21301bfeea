"""The names by which a motion calls joints: their own, and one name for the joints of both sides.

Two joints of a body's groups are a pair when their names differ only in the side. A pair is called without
it: `ShoulderRoll` for `LShoulderRoll` and `RShoulderRoll`, `knee_joint` for `left_knee_joint` and its like.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.body import Body
from naoserver.kinematics import kinematics_of
from naoserver.parts import Joint

Sides = Mapping[str, float]
"""The joints of a name: each with 1, or with -1 if its angle is that of the left side with the other sign."""

_SIDES: Final = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"), ("l", "r"), ("L", "R"))


def names_of(body: Body) -> dict[str, Sides]:
    """Return each name that a motion of a body may give, with its joints.

    Joints that one motor drives have one name, and only the leading one is commanded.
    """
    pairs = list(_pairs(body))
    one_motor = {name for pair in body.couplings for name in (pair.leader, pair.follower)}
    paired = {joint.name for _, left, right in pairs for joint in (left, right)}
    names: dict[str, Sides] = {
        joint.name: {joint.name: 1.0}
        for joint in body.joints
        if joint.name in body.motors and not (joint.name in one_motor and joint.name in paired)
    }
    for name, left, right in pairs:
        sides = {left.name: 1.0, right.name: mirrored(body, left, right)}
        names.setdefault(name, {joint: sign for joint, sign in sides.items() if joint in body.motors})
    return names


def mirrored(body: Body, left: Joint, right: Joint) -> float:
    """Return 1 if equal angles of two joints are mirror images in the x-z plane, or -1 if opposite ones are.

    That is so when the right axis is the left one reflected, as a pseudovector: (-x, y, -z). If the ranges do
    not meet then, it is the other way round: a hand is open at 1 on either side, whatever its axis.
    """
    x, y, z = _axis(body, left)
    sign = 1.0 if np.dot((-x, y, -z), _axis(body, right)) > 0.0 else -1.0
    ends = sorted((sign * left.lower, sign * left.upper))
    return sign if ends[0] < right.upper and right.lower < ends[1] else -sign


def _axis(body: Body, joint: Joint) -> NDArray[np.float64]:
    """Return the axis of a joint in the root's frame while all joints are at 0."""
    axis: NDArray[np.float64] = kinematics_of(body).link_place(joint.child, {})[:3, :3] @ np.array(joint.axis)
    return axis


def _pairs(body: Body) -> Iterator[tuple[str, Joint, Joint]]:
    """Yield the pairs of joints of arms and legs, each with its name."""
    groups = body.groups
    for lefts, rights in ((groups.left_arm, groups.right_arm), (groups.left_leg, groups.right_leg)):
        for left in lefts:
            named = ((_without_side(left, right), right) for right in rights)
            name, right = next(((name, right) for name, right in named if name), ("", ""))
            if name:
                yield name, body.joint[left], body.joint[right]


def _without_side(left: str, right: str) -> str:
    """Return what two names are without the side, the only word that differs; empty if more does."""
    for side, other in _SIDES:
        for found in re.finditer(side, left):
            before, after = left[: found.start()], left[found.end() :]
            if before + other + after == right:
                return before.rstrip("_") + after if before else after.lstrip("_")
    words, others = left.split("_"), right.split("_")
    shared = [word for word, other in zip(words, others, strict=False) if word == other]
    return "_".join(shared) if len(words) == len(others) == len(shared) + 1 else ""
