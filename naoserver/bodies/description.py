"""Describe the looks of a body as plain data, for viewers such as the editor's page, and read them.

Shapes stand in the frames of their links. Lengths in m, quaternions as (x, y, z, w), colors as red, green and
blue from 0 to 1; shapes with a `glow`, from 0 to 1, emit light. Sizes are halves: half axes of an ellipsoid,
half sides of a box; radius and half length, along z, of a cylinder and of a capsule without its ends. The
vertices of meshes are int16 in units of `meshUnit` m and their indices uint16, both little-endian in base64;
a `mirrored` shape has its y coordinates negated.

A body looks as it says or as was made for it, or else plain: its contact shapes, in one color, and without
these sticks from joint to joint.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta, Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from naoserver.bodies import folder_of
from naoserver.bodies.body import LARGEST_DESCRIPTION, Body
from naoserver.bodies.capabilities import Color
from naoserver.bodies.kinematics import turned
from naoserver.bodies.looks import (
    Look,
    Looks,
    Material,
    PlacedShape,
    SeenShape,
    Shapes,
    Skin,
    read_looks,
    skin_names,
)
from naoserver.bodies.parts import MOST_PARTS, NO_TURN, NOWHERE, Name, Quaternion, Shape, Vector
from naoserver.errors import RobotError
from zenoh_ice.data import typed

_MATERIAL: Final = "plain"
GREY: Final = Material(color=(0.72, 0.74, 0.77), specular=0.3, shininess=0.3)
_STICK: Final = 0.012
"""Radius in m of the sticks."""
MESH_UNIT: Final = 1e-4
"""Unit of a mesh's vertices in m, for robots of less than 3 m."""
_LARGEST_VALUE: Final = 32767
_DIGITS: Final = 5
_MOST_SHAPES: Final = 5000

_Share = Annotated[float, Meta(ge=0.0, le=1.0)]
_Size = Annotated[float, Meta(ge=0.0, le=1000.0)]


class DescribedShape(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A shape on a link; one without a place has that of its link."""

    link: Name
    kind: Literal["mesh", "box", "sphere", "capsule", "cylinder", "ellipsoid", "ring"]
    color: tuple[_Share, _Share, _Share]
    size: Annotated[tuple[_Size, ...], Meta(max_length=3)] = ()
    position: Vector | None = None
    quaternion: Quaternion | None = None
    mesh: Annotated[int, Meta(ge=0)] = 0
    mirrored: bool = False
    glow: _Share = 0.0
    opacity: _Share = 1.0


class DescribedMesh(Struct, frozen=True):
    """A mesh, in base64."""

    vertices: str
    indices: str


class DescribedLooks(Struct, frozen=True, rename="camel"):
    """What is seen of a robot."""

    shapes: Annotated[tuple[DescribedShape, ...], Meta(max_length=_MOST_SHAPES)]
    meshes: Annotated[tuple[DescribedMesh, ...], Meta(max_length=MOST_PARTS)] = ()
    mesh_unit: Annotated[float, Meta(gt=0.0, le=1.0)] = MESH_UNIT


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
    """Return looks made of the contact shapes of a body, or of sticks if it has none."""
    shapes = tuple(seen(shape, _MATERIAL) for shape in body.shapes) or tuple(_sticks(body))
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


def _sticks(body: Body) -> Iterator[SeenShape]:
    """Yield a ball for each link, and a stick to it from the one that carries it."""
    for link in body.links:
        yield SeenShape(link.name, "ellipsoid", material=_MATERIAL, size=(2 * _STICK,) * 3)
    for joint in body.moved_by.values():
        if joint.origin != NOWHERE:
            yield SeenShape(joint.parent, "capsule", material=_MATERIAL, size=(_STICK,), to=joint.origin)


def _ends(capsule: Shape) -> tuple[Vector, Vector]:
    """Return the centers of the round ends of a capsule along its z axis."""
    x, y, z = capsule.position
    along_x, along_y, along_z = (capsule.size[1] * turned(capsule.turn)[:3, 2]).tolist()
    return (x - along_x, y - along_y, z - along_z), (x + along_x, y + along_y, z + along_z)


def describe_looks(looks: Looks, colors: Mapping[str, Color]) -> DescribedLooks:
    """Return the shell of a robot: its shapes, and the meshes among them.

    `colors` are those that its lights show.
    """
    skin, meshes = looks
    unit = max(
        [MESH_UNIT, *(float(np.abs(mesh.vertices).max()) / _LARGEST_VALUE for mesh in meshes.values())]
    )
    numbers = {mesh: number for number, mesh in enumerate(meshes)}
    return DescribedLooks(
        tuple(_described(part, skin.look(part, colors), numbers) for part in skin.parts()),
        tuple(
            DescribedMesh(
                _base64(np.round(mesh.vertices / unit).astype("<i2")), _base64(mesh.faces.astype("<u2"))
            )
            for mesh in meshes.values()
        ),
        unit,
    )


def write_looks(body: Body, shirt: Color | None = None) -> str:
    """Return the looks of a body as JSON, its trunk in the color of a shirt if it has one."""
    described = describe_looks(looks_of(body), start_of(body))
    if shirt is not None:
        dressed = (
            replace(shape, color=shirt) if shape.link == body.root.name and not shape.glow else shape
            for shape in described.shapes
        )
        described = replace(described, shapes=tuple(dressed))
    return msgspec.json.encode(described).decode()


def read_described_looks(text: str, body: Body) -> DescribedLooks:
    """Return the looks of a body that JSON describes.

    Raises RobotError unless there are the links, meshes and vertices that shapes and meshes use.
    """
    if len(text) > LARGEST_DESCRIPTION:
        raise RobotError(f"the looks: {len(text)} characters, and at most {LARGEST_DESCRIPTION} are read")
    try:
        looks = typed.from_json(text, DescribedLooks)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise RobotError(f"the looks cannot be read: {error}") from error
    links = {link.name for link in body.links}
    for shape in looks.shapes:
        if shape.link not in links:
            raise RobotError(f"there is no link {shape.link!r}, to which a shape belongs")
        if shape.kind == "mesh" and shape.mesh >= len(looks.meshes):
            raise RobotError(f"there is no mesh {shape.mesh}, of {len(looks.meshes)}")
    for number, mesh in enumerate(looks.meshes):
        try:
            vertices = base64.b64decode(mesh.vertices, validate=True)
            indices = base64.b64decode(mesh.indices, validate=True)
        except ValueError as error:
            raise RobotError(f"mesh {number} is not base64: {error}") from error
        if len(vertices) % 6 or len(indices) % 6:
            raise RobotError(f"mesh {number} does not consist of triangles")
        if indices and np.frombuffer(indices, "<u2").max() >= len(vertices) // 6:
            raise RobotError(f"mesh {number} uses a vertex that it lacks")
    return looks


def _described(part: PlacedShape, look: Look, meshes: Mapping[str, int]) -> DescribedShape:
    shape = part.shape
    red, green, blue = (round(value, 3) for value in look.color)
    found = DescribedShape(
        link=part.link,
        kind="cylinder" if shape.kind == "disc" else shape.kind,
        color=(red, green, blue),
        glow=round(look.emission, 3),
        opacity=round(look.opacity, 3),
    )
    if shape.kind == "mesh":
        found = replace(found, mesh=meshes[shape.mesh], mirrored=part.mirrored)
        if shape.at == NOWHERE and shape.turn == NO_TURN:
            return found
    mirror = np.array([1.0, -1.0 if part.mirrored else 1.0, 1.0])
    size, place, axis = _primitive(shape, mirror)
    turn = _turn_to(*axis / np.linalg.norm(axis))
    if shape.turn != NO_TURN:
        w, x, y, z = shape.turn
        turn = (-x, y, -z, w) if part.mirrored else (x, y, z, w)
    sizes = () if shape.kind == "mesh" else tuple(rounded(size))
    (x, y, z), (i, j, k, w) = rounded(place), rounded(turn)
    return replace(found, size=sizes, position=(x, y, z), quaternion=(i, j, k, w))


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


def rounded(values: Iterable[float]) -> list[float]:
    """Return numbers without needless digits, and without a negative zero."""
    return [round(float(value), _DIGITS) + 0.0 for value in values]


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode()
