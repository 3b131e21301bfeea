"""Looks of robots: in the folder of a body `looks.toml` has shapes, and `looks.obj` the meshes among them.

The shapes stand in the frames of the links that carry them, in m. The file of the Nao explains the keys. The
meshes of the other robots are made from lofts: see `tools/lofts`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import resources
from itertools import pairwise
from typing import Final, Literal, NamedTuple

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from naoserver.bodies.capabilities import Color, Vector
from naoserver.bodies.parts import NO_TURN, Quaternion
from naoserver.errors import RobotError
from zenoh_ice.data.toml_file import parse_toml

_BODIES: Final = resources.files("naoserver") / "bodies"
OFF: Final[Color] = (0.0, 0.0, 0.0)
_GLASS: Final = (0.62, 0.65, 0.68)
"""The color of a lamp that is off."""
_WHITE: Final = (0.52, 0.74, 0.80)
"""The white of LEDs, which is cold; emitted light is added to it."""
_PALE: Final = 0.25
"""Share of white in the color of a lamp, because it dazzles."""
_EMISSION: Final = 0.7


class Look(NamedTuple):
    """A color of a surface, the share of it that is emitted, and how little shines through."""

    color: Color
    emission: float
    opacity: float = 1.0


def look_of(light: Color) -> Look:
    """Return the look of a lamp that shows a color."""
    brightness = max(light)
    red, green, blue = (
        glass * (1.0 - brightness) + white * ((1.0 - _PALE) * shown + _PALE * brightness)
        for glass, white, shown in zip(_GLASS, _WHITE, light, strict=True)
    )
    return Look((red, green, blue), _EMISSION * brightness)


class Material(Struct, frozen=True, forbid_unknown_fields=True):
    """A surface: its color, how it reflects light, the share of its color that it emits, its opacity."""

    color: Vector
    specular: float
    shininess: float
    emission: float = 0.0
    opacity: float = 1.0


class SeenShape(Struct, frozen=True, forbid_unknown_fields=True):
    """A shape on a link, as the comments in the looks of the Nao explain it."""

    link: str
    kind: Literal["mesh", "ellipsoid", "box", "capsule", "disc"]
    material: str = ""
    light: str = ""
    mesh: str = ""
    size: tuple[float, ...] = ()
    at: Vector = (0.0, 0.0, 0.0)
    to: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)
    turn: Quaternion = NO_TURN
    twice: bool = False


class PlacedShape(NamedTuple):
    """A shape on one of the links on which it is seen."""

    shape: SeenShape
    link: str
    mirrored: bool
    """Whether it is the mirror image with respect to the plane y = 0 of the link."""
    light: str
    """The group of lights as which it shines; empty if none."""


class Shapes(Struct, frozen=True, forbid_unknown_fields=True):
    """The shapes of the shell, and of the blocks that may be shown in its place."""

    shell: tuple[SeenShape, ...]
    blocks: tuple[SeenShape, ...]


class Skin(Struct, frozen=True, forbid_unknown_fields=True):
    """What is seen of a robot."""

    materials: dict[str, Material]
    mirror: dict[str, str]
    """For links of the left side, those of the right side that look the same, mirrored."""
    shapes: Shapes

    def __post_init__(self) -> None:
        for shape in (*self.shapes.shell, *self.shapes.blocks):
            if bool(shape.light) == bool(shape.material):
                raise ValueError(f"a {shape.kind} on {shape.link}: write either its material or its light")
            if shape.material and shape.material not in self.materials:
                raise ValueError(f"a {shape.kind} on {shape.link}: there is no material {shape.material}")

    def parts(self, *, shell: bool = True) -> Iterator[PlacedShape]:
        """Yield what is seen of the robot: its shell, or bare blocks."""
        for shape in self.shapes.shell if shell else self.shapes.blocks:
            yield PlacedShape(shape, shape.link, mirrored=False, light=shape.light.replace("{side}", "Left"))
            opposite = self.mirror.get(shape.link, shape.link if shape.twice else "")
            if opposite:
                yield PlacedShape(
                    shape, opposite, mirrored=True, light=shape.light.replace("{side}", "Right")
                )

    @property
    def lights(self) -> tuple[str, ...]:
        """The groups of lights that have lamps on the shell."""
        return tuple(dict.fromkeys(part.light for part in self.parts() if part.light))

    def look(self, part: PlacedShape, colors: Mapping[str, Color]) -> Look:
        """Return how a part looks while the groups of lights show `colors`; a group without one is off."""
        if part.light:
            return look_of(colors.get(part.light, OFF))
        material = self.materials[part.shape.material]
        return Look(material.color, material.emission, material.opacity)


class Mesh(NamedTuple):
    """A surface of triangles."""

    vertices: NDArray[np.float64]
    """Shape (n, 3) in m."""
    faces: NDArray[np.int32]
    """Shape (m, 3): indices of vertices, counter-clockwise from outside."""
    smooth: bool = True
    """Whether all of its edges look round, also sharp ones."""


class Looks(NamedTuple):
    """What is seen of a robot, and the meshes among it by name."""

    skin: Skin
    meshes: Mapping[str, Mesh]


def skin_names() -> tuple[str, ...]:
    """Return the names of the folders of bodies that have looks."""
    return tuple(sorted(folder.name for folder in _BODIES.iterdir() if (folder / "looks.toml").is_file()))


@cache
def read_looks(name: str) -> Looks:
    """Return the looks of this name, such as `nao`. Raises RobotError when there are none.

    The meshes, a file in Wavefront's format, are called by the names of its objects.
    """
    if name not in skin_names():
        raise RobotError(f"there are no looks of {name!r}; there are those of {', '.join(skin_names())}")
    folder = _BODIES / name
    skin = parse_toml((folder / "looks.toml").read_text("utf-8"), Skin, f"{name}/looks.toml", RobotError)
    meshes, before = {}, 0
    for part in (folder / "looks.obj").read_text("utf-8").split("\no ")[1:]:
        title, *lines = part.splitlines()
        rows = [line.split() for line in lines]
        vertices = np.array([row[1:] for row in rows if row[0] == "v"], np.float64)
        polygons = [row[1:] for row in rows if row[0] == "f"]
        corners = [(first, *pair) for first, *rest in polygons for pair in pairwise(rest)]
        meshes[title] = Mesh(vertices, np.array(corners, np.int32) - 1 - before)
        before += len(vertices)
    return Looks(skin, meshes)
