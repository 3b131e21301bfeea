"""Describe the world, for viewers without MuJoCo."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.capabilities import Pose, WorldShape
from naoserver.looks.description import rounded
from naoserver.soccer_field.model import Field
from naoserver_sim._surroundings import WHITE
from naoserver_sim.model import Model

NO_COLOR: Final = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's color and opacity of a geom that names none."""
_UPRIGHT: Final = (1.0, 0.0, 0.0, 0.0)
_LIFT: Final = 0.001
"""Height of lines above the floor in m."""
_KINDS: Final[dict[int, Literal["Plane", "Box", "Sphere", "Capsule"]]] = {
    mujoco.mjtGeom.mjGEOM_PLANE: "Plane",
    mujoco.mjtGeom.mjGEOM_BOX: "Box",
    mujoco.mjtGeom.mjGEOM_SPHERE: "Sphere",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "Capsule",
}
"""The forms of which the surroundings are made."""


def describe_world(model: Model) -> list[WorldShape]:
    """Return everything visible in a model except the robot, and the lines of its field."""
    mj, data = model.mj, mujoco.MjData(model.mj)
    mujoco.mj_kinematics(mj, data)
    objects = {int(mj.body(name).id): name for name in (*model.balls, *model.loose)}
    shapes = []
    for geom in range(mj.ngeom):
        body = int(mj.geom_bodyid[geom])
        # The picture of a sign is a plane in front of its board.
        picture = mj.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE and mj.geom(geom).name != "floor"
        if picture or mj.body_rootid[body] == model.base.body:
            continue
        if body in objects:
            place, turn = mj.geom_pos[geom], mj.geom_quat[geom]
        else:
            place, turn = data.geom_xpos[geom], np.zeros(4)
            mujoco.mju_mat2Quat(turn, data.geom_xmat[geom])
        w, x, y, z = turn.tolist()
        red, green, blue, opacity = color_of(mj, geom)
        shapes.append(
            WorldShape(
                kind=_KINDS[int(mj.geom_type[geom])],
                size=_vector(mj.geom_size[geom]),
                pose=Pose(_vector(place), (w, x, y, z)),
                color=(red, green, blue),
                opacity=opacity,
                object=objects.get(body, ""),
            )
        )
    return [*shapes, *(() if model.world.field is None else _lines(model.world.field))]


def color_of(mj: mujoco.MjModel, geom: int) -> tuple[float, float, float, float]:
    """Return the color and the opacity of a geom as MuJoCo shows it; for a texture, its average color."""
    material = int(mj.geom_matid[geom])
    own: tuple[float, float, float, float] = tuple(mj.geom_rgba[geom].tolist())
    if material < 0 or own != NO_COLOR:
        return own
    texture = int(mj.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB])
    if texture < 0:
        red, green, blue, opacity = mj.mat_rgba[material].tolist()
        return red, green, blue, opacity
    begin, channels = int(mj.tex_adr[texture]), int(mj.tex_nchannel[texture])
    count = int(mj.tex_width[texture]) * int(mj.tex_height[texture])
    pixels = mj.tex_data[begin : begin + count * channels].reshape(-1, channels)
    red, green, blue = (np.resize(pixels.mean(axis=0), 3) / 255.0).tolist()
    return red, green, blue, 1.0


def _lines(field: Field) -> Iterator[WorldShape]:
    for (x, y), (half_x, half_y) in field.lines():
        for place in dict.fromkeys((side_x * x, side_y * y) for side_x in (1, -1) for side_y in (1, -1)):
            pose = Pose((*place, 0.0), _UPRIGHT)
            yield WorldShape("Box", (half_x, half_y, _LIFT), pose, WHITE)
    circle = (field.circle_diameter / 2, field.line / 2, 0.0)
    yield WorldShape("Ring", circle, Pose((0.0, 0.0, _LIFT), _UPRIGHT), WHITE)


def _vector(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = rounded(values)
    return x, y, z
