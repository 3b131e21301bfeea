"""Appearance of the robot: shapes and materials from skin.toml, meshes from skin.obj, and lamps that shine.

None of it takes part in contacts.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib import resources
from typing import Any, Final, Literal, NamedTuple

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.capabilities import Color, Vector
from naoserver.expression import START

VISUAL_GROUP: Final = 1
"""The group of the geoms that the cameras see of the robot."""
_GLASS: Final = (0.62, 0.65, 0.68)
"""The color of a lamp that is off."""
_WHITE: Final = (0.52, 0.74, 0.80)
"""The white of LEDs, which is cold; emitted light is added to it."""
_PALE: Final = 0.25
"""Share of white in the color of a lamp, because it dazzles."""
_EMISSION: Final = 0.7

_PRIMITIVES: Final = {
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "disc": mujoco.mjtGeom.mjGEOM_CYLINDER,
}


class Look(NamedTuple):
    """A color of a surface, and the share of it that is emitted."""

    color: Color
    emission: float


def look_of(light: Color) -> Look:
    """Return the look of a lamp that shows a color."""
    brightness = max(light)
    red, green, blue = (
        glass * (1.0 - brightness) + white * ((1.0 - _PALE) * shown + _PALE * brightness)
        for glass, white, shown in zip(_GLASS, _WHITE, light, strict=True)
    )
    return Look((red, green, blue), _EMISSION * brightness)


class _Material(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    color: Vector
    specular: float
    shininess: float


class Shape(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A shape on a link, as the comments in skin.toml explain it."""

    link: str
    kind: Literal["mesh", "ellipsoid", "box", "capsule", "disc"]
    material: str = ""
    light: str = ""
    mesh: str = ""
    size: tuple[float, ...] = ()
    at: Vector = (0.0, 0.0, 0.0)
    to: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)
    twice: bool = False

    def places(self) -> Iterator[tuple[str, bool]]:
        """Yield the links that it is on, each with whether it is mirrored there."""
        yield self.link, False
        if self.link.startswith("l_"):
            yield f"r_{self.link[2:]}", True
        elif self.twice:
            yield self.link, True

    def shining(self, *, mirrored: bool) -> str:
        """Return the group of lights to which it belongs; empty if none."""
        sided = self.light and (self.twice or self.link.startswith("l_"))
        return f"{'Right' if mirrored else 'Left'}{self.light}" if sided else self.light

    def look(self, *, mirrored: bool) -> Look:
        """Return how it looks after the start."""
        if light := self.shining(mirrored=mirrored):
            return look_of(START[light])
        return Look(read_skin().materials[self.material].color, 0.0)


class _Looks(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    shell: tuple[Shape, ...]
    blocks: tuple[Shape, ...]


class _Skin(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    materials: dict[str, _Material]
    looks: _Looks


class Mesh(NamedTuple):
    """A surface of triangles."""

    vertices: NDArray[np.float64]
    """Shape (n, 3) in m."""
    faces: NDArray[np.int32]
    """Shape (m, 3): indices of vertices, counter-clockwise from outside."""


def add_appearance(spec: mujoco.MjSpec, links: Mapping[str, mujoco.MjsBody], *, skin: bool) -> None:
    """Add the visible shapes to the links of a body: its shell, or bare blocks."""
    look = read_skin()
    for light, color in START.items():
        shown = look_of(color)
        spec.add_material(
            name=lamp_material(light), rgba=[*shown.color, 1.0], emission=shown.emission, specular=0.0
        )
    for name, material in look.materials.items():
        spec.add_material(
            name=name,
            rgba=[*material.color, 1.0],
            specular=material.specular,
            shininess=material.shininess,
        )
    for shape in look.looks.shell if skin else look.looks.blocks:
        for link, mirrored in shape.places():
            links[link].add_geom(
                spec.find_default("skin"),
                type=_PRIMITIVES[shape.kind],
                material=shape.material or lamp_material(shape.shining(mirrored=mirrored)),
                **_geometry(spec, shape, mirrored=mirrored),
            )


def _geometry(spec: mujoco.MjSpec, shape: Shape, *, mirrored: bool) -> dict[str, Any]:
    """Return the attributes in MuJoCo of a shape's form and place."""
    mirror = np.array([1.0, -1.0 if mirrored else 1.0, 1.0])
    if shape.kind == "mesh":
        return {"meshname": _add_mesh(spec, shape.mesh, mirrored=mirrored)}
    size = [*shape.size, 0.0, 0.0][:3]
    if shape.kind == "capsule":
        return {"size": size, "fromto": [*(mirror * shape.at), *(mirror * shape.to)]}
    return {"size": size, "pos": mirror * shape.at, "zaxis": mirror * shape.normal}


def _add_mesh(spec: mujoco.MjSpec, name: str, *, mirrored: bool) -> str:
    """Add a mesh or its mirror image; return its name in the model."""
    vertices, faces = read_meshes()[name]
    added = f"{name} mirrored" if mirrored else name
    spec.add_mesh(
        name=added,
        uservert=(vertices * [1, -1, 1] if mirrored else vertices).flatten(),
        userface=(faces[:, ::-1] if mirrored else faces).flatten(),
        smoothnormal=True,
        # Panels are open below and have no volume.
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    return added


@cache
def read_skin() -> _Skin:
    """Return the appearance of the robot from skin.toml."""
    text = resources.files("naoserver_sim").joinpath("skin.toml").read_text(encoding="utf-8")
    return msgspec.convert(tomllib.loads(text), _Skin)


@cache
def read_meshes() -> Mapping[str, Mesh]:
    """Return the meshes of skin.obj, a file in Wavefront's format, by the names of its objects."""
    text = resources.files("naoserver_sim").joinpath("skin.obj").read_text(encoding="utf-8")
    meshes, before = {}, 0
    for part in text.split("\no ")[1:]:
        name, *lines = part.splitlines()
        rows = [line.split() for line in lines]
        vertices = np.array([row[1:] for row in rows if row[0] == "v"], np.float64)
        faces = np.array([row[1:] for row in rows if row[0] == "f"], np.int32)
        meshes[name] = Mesh(vertices, faces - 1 - before)
        before += len(vertices)
    return meshes


def lamp_material(light: str) -> str:
    """Return the name of the material of a group's lamps."""
    return f"light {light}"


class Lamps:
    """Show the robot's lights on the lamps of a model."""

    def __init__(self, mj: mujoco.MjModel, colors: Callable[[], Mapping[str, Color]]) -> None:
        self._mj = mj
        self._colors = colors
        self._materials = {
            light: mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_MATERIAL, lamp_material(light))
            for light in START
        }
        self._shown: Mapping[str, Color] = dict(START)

    def show(self) -> None:
        """Show the present lights; for the drawing thread."""
        colors = self._colors()
        if colors == self._shown:
            return
        self._shown = colors
        for light, material in self._materials.items():
            look = look_of(colors[light])
            self._mj.mat_rgba[material, :3] = look.color
            self._mj.mat_emission[material] = look.emission
