"""Several robots in one model, each on its feet at its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import msgspec
import mujoco
import numpy as np

from naoserver.bodies.capabilities import Color
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim._body import BASE
from naoserver_sim._share import move_in, share_of
from naoserver_sim._surroundings import add_surroundings
from naoserver_sim.appearance import VISUAL_GROUP, paint
from naoserver_sim.model import FreeIndex, Model, add_robot, free_index, new_spec
from naoserver_sim.standing import build_standing
from naoserver_sim.world import StartPose, World

_SEPARATOR: Final = "/"
"""Between the name of a robot and those of its parts; no name in a world has it."""
_TOUCHING: Final = -0.001
"""Depth in m from which things overlap at the start."""


@dataclass(frozen=True)
class Placed:
    """A robot that is to stand in a world."""

    name: str
    body: Body
    start: StartPose
    shirt: Color | None = None


def stand_together(
    world: World, robots: Sequence[Placed], posture: str | None, *, skin: bool
) -> tuple[tuple[Model, ...], mujoco.MjData]:
    """Return the models of robots that share a whole, and the state in which all of them stand.

    The first has no prefix, and the objects of the world are in its share: alone, it has the model that a
    robot alone always has. Raises RobotError when some are in each other's way, or a wall's.
    """
    first, *others = robots
    home = msgspec.structs.replace(world, robot=first.start, robots=())
    if not others:
        model, data = build_standing(home, posture, skin=skin, body=first.body)
        _dress(model.whole, first, "")
        return (model,), data
    worlds = [home, *(World(robot=robot.start) for robot in others)]
    alone = [
        build_standing(own, posture, skin=False, body=robot.body)
        for own, robot in zip(worlds, robots, strict=True)
    ]
    prefixes = ["", *(robot.name + _SEPARATOR for robot in others)]
    spec = new_spec()
    add_surroundings(spec, home)
    for own, robot, prefix in zip(worlds[1:], others, prefixes[1:], strict=True):
        _attach(spec, own, robot.body, prefix, skin=skin)
    add_robot(spec, home, first.body, skin=skin)
    whole = spec.compile()
    roots = {
        robot.name: free_index(whole, prefix + robot.body.root.name, prefix + BASE)
        for robot, prefix in zip(robots, prefixes, strict=True)
    }
    loose = {name: free_index(whole, name, name) for name in home.loose}
    models = []
    data = mujoco.MjData(whole)
    for robot, prefix, (model, state) in zip(robots, prefixes, alone, strict=True):
        share = share_of(whole, model.mj, robot.body.root.name, prefix)
        move_in(whole, data, share, model.mj, state)
        _dress(whole, robot, prefix)
        rest = {name: index for name, index in roots.items() if name != robot.name}
        models.append(replace(model, world=home, whole=whole, share=share, others=rest, loose=loose))
    mujoco.mj_forward(whole, data)
    _require_room(whole, data, roots)
    return tuple(models), data


def _attach(spec: mujoco.MjSpec, world: World, body: Body, prefix: str, *, skin: bool) -> None:
    """Add a robot whose names begin with a prefix, and the place where it starts."""
    own = new_spec()
    for there in (*own.worldbody.lights, *own.materials, *own.textures):
        own.delete(there)
    add_robot(own, world, body, skin=skin)
    most = max(spec.option.ls_iterations, own.option.ls_iterations)
    spec.option.ls_iterations = own.option.ls_iterations = most
    spec.attach(own, prefix=prefix, frame=spec.worldbody.add_frame())


def _dress(mj: mujoco.MjModel, robot: Placed, prefix: str) -> None:
    """Give a robot its shirt."""
    if robot.shirt is not None:
        trunk = mj.body(prefix + robot.body.root.name).id
        paint(mj, np.flatnonzero((mj.geom_bodyid == trunk) & (mj.geom_group == VISUAL_GROUP)), robot.shirt)


def _require_room(mj: mujoco.MjModel, data: mujoco.MjData, roots: Mapping[str, FreeIndex]) -> None:
    """Raise RobotError when a robot overlaps another one or something that stands firm on the floor."""
    names = {index.body: name for name, index in roots.items()}
    floor = mj.geom("floor").id
    for contact in data.contact:
        if floor in (contact.geom1, contact.geom2):
            continue  # heavy robots on small feet sink into it
        bodies = [int(mj.body_rootid[mj.geom_bodyid[geom]]) for geom in (contact.geom1, contact.geom2)]
        who = [name for body, name in names.items() if body in bodies]
        if contact.dist < _TOUCHING and who and bodies[0] != bodies[1]:
            with_what = who[1] if len(who) > 1 else "something there"
            raise RobotError(
                f"robot {who[0]} has no room where it starts: it overlaps {with_what}; place it elsewhere"
            )
