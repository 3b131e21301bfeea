"""Describe a body and its looks as plain data, for viewers such as the editor's page.

Shapes stand in the frames of their links. Lengths in m, quaternions as (x, y, z, w), colors as red, green and
blue from 0 to 1; shapes with a `glow`, from 0 to 1, emit light. Sizes are halves: half axes of an ellipsoid,
half sides of a box; radius and half length, along z, of a cylinder and of a capsule without its ends. The
vertices of meshes are int16 in units of `meshUnit` m and their indices uint16, both little-endian in base64;
a `mirrored` shape has its y coordinates negated.

A body looks as it says or as was made for it, or else plain: its contact shapes, in one color.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies import folder_of
from naoserver.bodies.body import Body
from naoserver.bodies.capabilities import Color, Vector
from naoserver.bodies.kinematics import turned
from naoserver.bodies.looks import (
    Look,
    Looks,
    Material,
    Part,
    SeenShape,
    Shapes,
    Skin,
    read_looks,
    skin_names,
)
from naoserver.bodies.parts import NO_TURN, NOWHERE, Shape

_MATERIAL: Final = "plain"
GREY: Final = Material(color=(0.72, 0.74, 0.77), specular=0.3, shininess=0.3)


def looks_of(body: Body) -> Looks:
    """Return a body's own looks, those of its folder in `naoserver.bodies`, or else plain ones."""
    if body.looks is not None:
        return body.looks
    folder = folder_of(body)
    return read_looks(folder) if folder in skin_names() else plain_looks(body)


def start_of(body: Body) -> Mapping[str, Color]:
    """Return the colors of a body's lights after the start."""
    return {name: lamp.start for name, lamp in body.lights.items()}


def plain_looks(body: Body) -> Looks:
    """Return looks made of the contact shapes of a body."""
    shapes = tuple(seen(shape, _MATERIAL) for shape in body.shapes)
    skin = Skin(materials={_MATERIAL: GREY}, mirror={}, shapes=Shapes(shell=shapes, blocks=shapes))
    return Looks(skin, {})


def seen(shape: Shape, material: str) -> SeenShape:
    """Return how a contact shape looks in a material; a hull as the box around it."""
    shape = shape.boxed()
    link, at, size = shape.link, shape.position, shape.size
    if shape.kind == "sphere":
        return SeenShape(link, "ellipsoid", material=material, size=size * 3, at=at)
    if shape.kind in ("box", "ellipsoid"):
        return SeenShape(link, shape.kind, material=material, size=size, at=at, turn=shape.turn)
    if shape.kind == "cylinder":
        return SeenShape(link, "disc", material=material, size=size, at=at, turn=shape.turn)
    begin, end = shape.ends or _ends(shape)
    return SeenShape(link, "capsule", material=material, size=size[:1], at=begin, to=end)


def _ends(capsule: Shape) -> tuple[Vector, Vector]:
    """Return the centers of the round ends of a capsule along its z axis."""
    x, y, z = capsule.position
    along_x, along_y, along_z = (capsule.size[1] * turned(capsule.turn)[:3, 2]).tolist()
    return (x - along_x, y - along_y, z - along_z), (x + along_x, y + along_y, z + along_z)


MESH_UNIT: Final = 1e-4
"""Unit of a mesh's vertices in m, for robots of less than 3 m."""
_LARGEST_VALUE: Final = 32767
_DIGITS: Final = 5


def describe_looks(looks: Looks, colors: Mapping[str, Color]) -> dict[str, Any]:
    """Return the shell of a robot: its shapes, and the meshes among them.

    `colors` are those that its lights show.
    """
    skin, meshes = looks
    unit = max(
        [MESH_UNIT, *(float(np.abs(mesh.vertices).max()) / _LARGEST_VALUE for mesh in meshes.values())]
    )
    numbers = {mesh: number for number, mesh in enumerate(meshes)}
    return {
        "meshUnit": unit,
        "shapes": [
            {"link": part.link, **_form(part, numbers), **_surface(skin.look(part, colors))}
            for part in skin.parts()
        ],
        "meshes": [
            {
                "vertices": _base64(np.round(mesh.vertices / unit).astype("<i2")),
                "indices": _base64(mesh.faces.astype("<u2")),
            }
            for mesh in meshes.values()
        ],
    }


def write_looks(body: Body, shirt: Color | None = None) -> str:
    """Return the looks of a body as JSON, its trunk in the color of a shirt if it has one."""
    described = describe_looks(looks_of(body), start_of(body))
    for shape in described["shapes"] if shirt is not None else ():
        if shape["link"] == body.root.name and "glow" not in shape:
            shape["color"] = shirt
    return json.dumps(described, separators=(",", ":"), allow_nan=False)


def _form(part: Part, meshes: Mapping[str, int]) -> dict[str, Any]:
    shape = part.shape
    mirror = np.array([1.0, -1.0 if part.mirrored else 1.0, 1.0])
    size, place, axis = _primitive(shape, mirror)
    turn = _turn_to(*axis / np.linalg.norm(axis))
    if shape.turn != NO_TURN:
        w, x, y, z = shape.turn
        turn = (-x, y, -z, w) if part.mirrored else (x, y, z, w)
    placed = {"position": rounded(place), "quaternion": rounded(turn)}
    if shape.kind == "mesh":
        in_the_links_frame = shape.at == NOWHERE and shape.turn == NO_TURN
        mesh = {"kind": "mesh", "mesh": meshes[shape.mesh], "mirrored": part.mirrored}
        return mesh if in_the_links_frame else mesh | placed
    return {"kind": "cylinder" if shape.kind == "disc" else shape.kind, "size": rounded(size), **placed}


def _primitive(
    shape: SeenShape, mirror: NDArray[np.float64]
) -> tuple[list[float], NDArray[np.float64], NDArray[np.float64]]:
    """Return the half sizes, the middle and the axis of a shape."""
    size = [*shape.size, 0.0, 0.0][:3]
    if shape.kind != "capsule":
        return size, mirror * shape.at, mirror * shape.normal
    begin, end = mirror * shape.at, mirror * shape.to
    size[1] = float(np.linalg.norm(begin - end)) / 2
    return size, (begin + end) / 2, begin - end


def _turn_to(x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Return the shortest rotation, as a quaternion (x, y, z, w), from the z axis to a unit vector."""
    across = math.hypot(x, y)
    if across == 0.0:
        return (0.0, 0.0, 0.0, 1.0) if z > 0.0 else (1.0, 0.0, 0.0, 0.0)
    half = math.atan2(across, z) / 2
    share = math.sin(half) / across
    return -y * share, x * share, 0.0, math.cos(half)


def _surface(look: Look) -> dict[str, Any]:
    glow = {"glow": round(look.emission, 3)} if look.emission > 0 else {}
    opacity = {"opacity": round(look.opacity, 3)} if look.opacity < 1 else {}
    return {"color": [round(value, 3) for value in look.color], **glow, **opacity}


def rounded(values: Iterable[float]) -> list[float]:
    """Return numbers without needless digits, and without a negative zero."""
    return [round(float(value), _DIGITS) + 0.0 for value in values]


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode()
