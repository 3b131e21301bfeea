"""What there is to be seen in a world: balls, boxes, other robots, signs, and what is on a field."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from naoserver.bodies.capabilities import Color
from naoserver.bodies.sight import color_name
from naoserver.soccer_field import POST_RADIUS, FieldLines
from naoserver_sim.appearance import VISUAL_GROUP, color_of
from naoserver_sim.model import Model
from naoserver_sim.world import BALL_RADIUS, World

_SLACK: Final = 0.02
"""Distance in m before a thing up to which what a ray meets is the thing itself."""
_ON_FLOOR: Final = ("robot", "crossing", "line")


class Target(NamedTuple):
    """Something that may be seen."""

    kind: str
    name: str
    middle: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """In the world's frame; of what moves, that of its body counts."""
    base: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where it stands."""
    slack: float = _SLACK
    """How far in front of its middle its surface may be, in m."""
    body: int = -1
    """Its body in the model; -1 of what stands firm."""
    radius: float = 0.0
    """Of a ball."""

    def is_on_floor(self, height: float) -> bool:
        """Return whether it is on the floor when its middle is at a height in m."""
        return self.kind in _ON_FLOOR or (self.radius > 0.0 and height < 2.0 * self.radius)


def moving_targets(model: Model) -> Iterator[Target]:
    """Yield what moves in the whole model, the other robots first."""
    mj, world = model.whole, model.world
    for index in model.others.values():
        trunk = np.flatnonzero((mj.geom_bodyid == index.body) & (mj.geom_group == VISUAL_GROUP)).tolist()
        shirt = color_name(color_of(mj, trunk[0])[:3]) if trunk else ""
        yield Target("robot", shirt, body=index.body)
    for ball in world.balls:
        yield _ball(model, ball.name, ball.color, ball.radius)
    for carried in world.carried_balls:
        yield _ball(model, carried.name, carried.color, BALL_RADIUS)
    for box in world.boxes:
        if box.mass is not None:
            yield Target("box", color_name(box.color), slack=max(box.size), body=int(mj.body(box.name).id))


def _ball(model: Model, name: str, color: Color, radius: float) -> Target:
    body = int(model.whole.body(name).id)
    return Target("ball", color_name(color), slack=radius, body=body, radius=radius)


def fixed_targets(world: World) -> Iterator[Target]:
    """Yield what stands firm in a world."""
    if (field := world.field) is not None:
        for x, y in field.posts:
            yield Target("goalpost", "", (x, y, field.goal_height / 2), (x, y, 0.0), POST_RADIUS + _SLACK)
        for x, y, kind in field.crossings:
            yield Target("crossing", kind, (x, y, 0.0), (x, y, 0.0))
        for x, y in FieldLines(field).samples.tolist():
            yield Target("line", "", (x, y, 0.0), (x, y, 0.0))
    for sign in world.signs:
        kind, name = ("face", "") if sign.landmark is None else ("tag", str(sign.landmark))
        yield Target(kind, name, (*sign.position, sign.height), (*sign.position, 0.0))
    for box in world.boxes:
        if box.mass is None:
            x, y = box.position
            yield Target("box", color_name(box.color), (x, y, box.size[2] / 2), (x, y, 0.0), max(box.size))
