"""Who touches whom: what stands firm touches what moves, and what moves touches one another."""

from __future__ import annotations

from itertools import combinations
from typing import Final

import mujoco

from naoserver.body import Body

FLOOR_BIT: Final = 1
"""The bit of what stands firm: floor, walls, heavy boxes."""
BODY_BIT: Final = 2
"""The bit of what moves: the links of the body, balls and boxes that can be pushed."""

FRICTION: Final = (1.0, 0.02, 0.001)
"""Along a surface, and in m about its normal and of rolling."""


def firm() -> dict[str, int]:
    """Return the bits of a geom that stands firm."""
    return {"contype": FLOOR_BIT, "conaffinity": BODY_BIT}


def moving() -> dict[str, int]:
    """Return the bits of a geom that moves."""
    return {"contype": BODY_BIT, "conaffinity": FLOOR_BIT | BODY_BIT}


def untouchable() -> dict[str, int]:
    """Return the bits of a geom that is only seen."""
    return {"contype": 0, "conaffinity": 0}


# The balls round the ankles reach into the other leg and into the thigh of a robot that merely crouches:
# shins and soles keep the legs apart, the range of the knee keeps the ankle off the thigh.
_COARSE: Final = ("l_ankle", "r_ankle")


def exclude_neighbors(spec: mujoco.MjSpec, body: Body) -> None:
    """Let links pass through each other that are always together, as the shapes of neighbors overlap."""
    for first, second in combinations([link.name for link in body.links], 2):
        if first in _COARSE or second in _COARSE or _are_neighbors(body, first, second):
            spec.add_exclude(bodyname1=first, bodyname2=second)


def _are_neighbors(body: Body, first: str, second: str) -> bool:
    """Return whether two links meet in joints at one point, or one carries the other there."""
    carriers = {joint.child: joint for joint in body.joints}

    def cluster(link: str) -> str:
        # The joints of a hip, an ankle or a shoulder lie at one point: what is between them is one neighbor.
        while link in carriers and not any(carriers[link].origin):
            link = carriers[link].parent
        return link

    def carrier(link: str) -> str | None:
        return cluster(carriers[link].parent) if link in carriers else None

    one, other = cluster(first), cluster(second)
    return one == other or carrier(one) == other or carrier(other) == one
