"""The looks of a body: its own or those made for it, or else plain ones: its contact shapes, in one color."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from naoserver.bodies import folder_of
from naoserver.body import Body
from naoserver.capabilities import Color, Vector
from naoserver.kinematics import turned
from naoserver.looks import Looks, Material, Shape, Shapes, Skin, read_looks, skin_names
from naoserver.parts import Shape as ContactShape

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


def seen(shape: ContactShape, material: str) -> Shape:
    """Return how a contact shape looks in a material; a hull as the box around it."""
    shape = shape.boxed()
    link, at, size = shape.link, shape.position, shape.size
    if shape.kind == "sphere":
        return Shape(link, "ellipsoid", material=material, size=size * 3, at=at)
    if shape.kind in ("box", "ellipsoid"):
        return Shape(link, shape.kind, material=material, size=size, at=at, turn=shape.turn)
    if shape.kind == "cylinder":
        return Shape(link, "disc", material=material, size=size, at=at, turn=shape.turn)
    begin, end = shape.ends or _ends(shape)
    return Shape(link, "capsule", material=material, size=size[:1], at=begin, to=end)


def _ends(capsule: ContactShape) -> tuple[Vector, Vector]:
    """Return the centers of the round ends of a capsule along its z axis."""
    x, y, z = capsule.position
    along_x, along_y, along_z = (capsule.size[1] * turned(capsule.turn)[:3, 2]).tolist()
    return (x - along_x, y - along_y, z - along_z), (x + along_x, y + along_y, z + along_z)
