"""Which links of a user's robot pass through each other: as those of its model, or from the start."""

from __future__ import annotations

from collections import Counter
from typing import Final

import mujoco

from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim._body import neighbors_of
from naoserver_sim._own.guesses import Guesses
from naoserver_sim._own.parts import Parts
from naoserver_sim.model import build_model
from naoserver_sim.world import load_world

_MANY: Final = 3
"""Links that a link does not touch, from which that is not said of each."""
_OVERLAP: Final = 0.0005
"""Depth in m from which shapes overlap."""


def guess_overlaps(found: Guesses, model: Parts, body: Body, where: str) -> None:
    """Let links that the model keeps from touching, or that overlap at rest, pass through each other.

    Raises RobotError, beginning with `where`, when more links overlap than MuJoCo has memory for.
    """
    mj = model.figure.mj
    links = [shape.link for shape in body.shapes]
    masks = {link: [0, 0] for link in links}
    for geom in model.figure.solid:
        mask = masks[model.frames[int(mj.geom_bodyid[geom])].link]
        mask[0] |= int(mj.geom_contype[geom])
        mask[1] |= int(mj.geom_conaffinity[geom])
    of = {body: frame.link for body, frame in model.frames.items()}
    apart = {
        _sorted(of.get(int(pair) >> 16, ""), of.get(int(pair) & 0xFFFF, "")) for pair in mj.exclude_signature
    }
    names, near, are_neighbors = sorted(masks), set(), neighbors_of(body)
    said = model.figure.says_what_touches
    for first, one in enumerate(names):
        for other in names[first + 1 :]:
            (types, affinities), (others, their) = masks[one], masks[other]
            if are_neighbors(one, other):
                near.add((one, other))
            elif said and not (types & their or others & affinities):
                apart.add((one, other))
    mine = build_model(load_world("empty"), skin=False, body=body)
    data = mujoco.MjData(mine.mj)
    data.qpos[mine.robot.qpos] = [body.resting_angles[joint.name] for joint in mine.robot.joints]
    try:
        mujoco.mj_fwdPosition(mine.mj, data)
    except mujoco.FatalError:  # its memory for contacts is full
        raise RobotError(f"{where}: too many of its links are in one place: move them apart") from None
    for contact in data.contact:
        first, second = (mine.mj.body(mine.mj.geom_bodyid[geom]).name for geom in contact.geom)
        if contact.dist < -_OVERLAP and {first, second} <= masks.keys():
            apart.add(_sorted(first, second))
    pairs = sorted(pair for pair in apart if pair[0] != pair[1] and set(pair) <= masks.keys())
    parted = near.union(pairs)
    far, said_far = (Counter(link for pair in each for link in pair) for each in (parted, pairs))
    alone = {link for link in names if far[link] == len(names) - 1 and said_far[link] >= _MANY}
    if alone:
        found.add(sorted(alone), "they touch no other link in the model", "intangible")
    if rest := [list(pair) for pair in pairs if alone.isdisjoint(pair)]:
        found.add(rest, "kept apart in the model, or overlapping at rest", "overlapping")


def _sorted(one: str, other: str) -> tuple[str, str]:
    return (one, other) if one < other else (other, one)
