"""Describe the visible shapes of the body and of the world, for viewers without MuJoCo.

`python -m naoserver_sim.geometry FILE` writes the links with their joints, their visible shapes in the links'
frames, as JSON. Lengths in m, quaternions as (x, y, z, w), colors as red, green, blue from 0
to 1; shapes with a `glow`, from 0 to 1, emit light. Sizes are halves: half axes of an ellipsoid, half sides
of a box; radius and half length, along z, of a cylinder and of a capsule without its ends. The vertices of
meshes are int16 in units of 0.1 mm and their indices uint16, both little-endian in base64; a `mirrored`
shape has its y coordinates negated.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, Literal

import mujoco
import numpy as np
import typer
from numpy.typing import NDArray

from naoserver.body import H25
from naoserver.capabilities import Pose, WorldShape
from naoserver.soccer_field.model import Field
from naoserver_sim._surroundings import WHITE
from naoserver_sim.appearance import Shape, read_meshes, read_skin
from naoserver_sim.model import Model

MESH_UNIT: Final = 1e-4
"""Unit of a mesh's vertices in m."""
_DIGITS: Final = 5
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


def describe_body() -> dict[str, Any]:
    """Return the body as plain data."""
    joints = {joint.child: joint for joint in H25.joints}
    links = []
    for link in H25.links:
        joint = joints.get(link.name)
        described: dict[str, Any] = {"name": link.name}
        if joint is not None:
            described |= {"parent": joint.parent, "joint": joint.name}
            described |= {"axis": list(joint.axis), "origin": list(joint.origin)}
        links.append(described)
    soles = {
        f"{side[0]}_foot": [[*point, -H25.facts["dimensions"]["foot_height"]] for point in outline]
        for side, outline in H25.facts["sole"].items()
        if side in ("left", "right")
    }
    meshes = read_meshes()
    numbers = {name: number for number, name in enumerate(meshes)}
    return {
        "generatedBy": "python -m naoserver_sim.geometry, from the facts and the skin of the H25",
        "meshUnit": MESH_UNIT,
        "links": links,
        "shapes": [
            {"link": link, **_form(shape, numbers, mirrored=mirrored), **_look(shape, mirrored=mirrored)}
            for shape in read_skin().looks.shell
            for link, mirrored in shape.places()
        ],
        "meshes": [
            {
                "vertices": _base64(np.round(mesh.vertices / MESH_UNIT).astype("<i2")),
                "indices": _base64(mesh.faces.astype("<u2")),
            }
            for mesh in meshes.values()
        ],
        "soles": soles,
    }


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
        red, green, blue, opacity = _color(mj, geom)
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


def _color(mj: mujoco.MjModel, geom: int) -> tuple[float, ...]:
    """Return the color and the opacity of a geom; for a texture, its average color."""
    material = int(mj.geom_matid[geom])
    if material < 0:
        return tuple(mj.geom_rgba[geom].tolist())
    texture = int(mj.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB])
    if texture < 0:
        return tuple(mj.mat_rgba[material].tolist())
    begin, channels = int(mj.tex_adr[texture]), int(mj.tex_nchannel[texture])
    count = int(mj.tex_width[texture]) * int(mj.tex_height[texture])
    pixels = mj.tex_data[begin : begin + count * channels].reshape(-1, channels)
    return (*(pixels.mean(axis=0)[:3] / 255.0).tolist(), 1.0)


def _lines(field: Field) -> Iterator[WorldShape]:
    for (x, y), (half_x, half_y) in field.lines():
        for place in dict.fromkeys((side_x * x, side_y * y) for side_x in (1, -1) for side_y in (1, -1)):
            pose = Pose((*place, 0.0), _UPRIGHT)
            yield WorldShape("Box", (half_x, half_y, _LIFT), pose, WHITE)
    circle = (field.circle_diameter / 2, field.line / 2, 0.0)
    yield WorldShape("Ring", circle, Pose((0.0, 0.0, _LIFT), _UPRIGHT), WHITE)


def _vector(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = _rounded(values)
    return x, y, z


def _form(shape: Shape, meshes: dict[str, int], *, mirrored: bool) -> dict[str, Any]:
    if shape.kind == "mesh":
        return {"kind": "mesh", "mesh": meshes[shape.mesh], "mirrored": mirrored}
    mirror = np.array([1.0, -1.0 if mirrored else 1.0, 1.0])
    size = [*shape.size, 0.0, 0.0][:3]
    place = mirror * shape.at
    axis = mirror * shape.normal
    if shape.kind == "capsule":
        end = mirror * shape.to
        place, axis = (place + end) / 2, place - end
        size[1] = float(np.linalg.norm(axis)) / 2
    quat = np.zeros(4)
    mujoco.mju_quatZ2Vec(quat, axis / np.linalg.norm(axis))
    w, x, y, z = quat
    return {
        "kind": {"disc": "cylinder"}.get(shape.kind, shape.kind),
        "size": _rounded(size),
        "position": _rounded(place),
        "quaternion": _rounded((x, y, z, w)),
    }


def _look(shape: Shape, *, mirrored: bool) -> dict[str, Any]:
    look = shape.look(mirrored=mirrored)
    glow = {"glow": round(look.emission, 3)} if look.emission > 0 else {}
    return {"color": [round(value, 3) for value in look.color], **glow}


def _rounded(values: Any) -> list[float]:  # noqa: ANN401 - an array, or numbers
    return [round(float(value), _DIGITS) + 0.0 for value in values]


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode()


def main(file: Path) -> None:
    """Write the body as JSON."""
    file.write_text(json.dumps(describe_body(), separators=(",", ":")) + "\n", encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
