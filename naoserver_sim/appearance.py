"""Appearance of the robot in MuJoCo: the shapes and materials of its looks, and lamps that shine.

None of it takes part in contacts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import Color
from naoserver.bodies.looks import OFF, Looks, Mesh, SeenShape, look_of
from naoserver.bodies.parts import NO_TURN

VISUAL_GROUP: Final = 1
"""The group of the geoms that the cameras see of the robot."""

NO_COLOR: Final = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's color and opacity of a geom that names none."""
_PRIMITIVES: Final = {
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "disc": mujoco.mjtGeom.mjGEOM_CYLINDER,
}


def add_appearance(
    spec: mujoco.MjSpec,
    links: Mapping[str, mujoco.MjsBody],
    looks: Looks,
    *,
    skin: bool,
    colors: Mapping[str, Color],
) -> None:
    """Add looks to the links of a body: its shell, or bare blocks.

    `colors` are those of its lights after the start.
    """
    look, meshes = looks
    for light in look.lights:
        shown = look_of(colors.get(light, OFF))
        spec.add_material(
            name=lamp_material(light), rgba=[*shown.color, 1.0], emission=shown.emission, specular=0.0
        )
    for title, material in look.materials.items():
        spec.add_material(
            name=title,
            rgba=[*material.color, material.opacity],
            specular=material.specular,
            shininess=material.shininess,
            emission=material.emission,
        )
    added: dict[tuple[str, bool], str] = {}
    for shape, link, mirrored, light in look.parts(shell=skin):
        form = _form(shape, mirrored=mirrored)
        if shape.kind == "mesh":
            key = shape.mesh, mirrored
            if key not in added:
                added[key] = _add_mesh(spec, shape.mesh, meshes[shape.mesh], mirrored=mirrored)
            form["meshname"] = added[key]
        links[link].add_geom(
            spec.find_default("skin"),
            type=_PRIMITIVES[shape.kind],
            material=shape.material or lamp_material(light),
            **form,
        )


def _form(shape: SeenShape, *, mirrored: bool) -> dict[str, Any]:
    """Return the attributes in MuJoCo of a shape's size and place."""
    mirror = np.array([1.0, -1.0 if mirrored else 1.0, 1.0])
    size = [*shape.size, 0.0, 0.0][:3]
    if shape.kind == "capsule":
        return {"size": size, "fromto": [*(mirror * shape.at), *(mirror * shape.to)]}
    if shape.turn != NO_TURN:
        w, x, y, z = shape.turn
        return {"size": size, "pos": mirror * shape.at, "quat": (w, -x, y, -z) if mirrored else shape.turn}
    return {"size": size, "pos": mirror * shape.at, "zaxis": mirror * shape.normal}


def _add_mesh(spec: mujoco.MjSpec, name: str, mesh: Mesh, *, mirrored: bool) -> str:
    """Add a mesh or its mirror image; return its name in the model."""
    vertices, faces, smooth = mesh
    added = f"{name} mirrored" if mirrored else name
    spec.add_mesh(
        name=added,
        uservert=(vertices * [1, -1, 1] if mirrored else vertices).flatten(),
        userface=(faces[:, ::-1] if mirrored else faces).flatten(),
        smoothnormal=smooth,
        # Panels are open below and have no volume.
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    return added


def lamp_material(light: str) -> str:
    """Return the name of the material of a group's lamps."""
    return f"light {light}"


class Lamps:
    """Show the robot's lights on the lamps of a model; a group of lights without lamps is not seen."""

    def __init__(
        self, mj: mujoco.MjModel, colors: Callable[[], Mapping[str, Color]], prefix: str = ""
    ) -> None:
        self._mj = mj
        self._prefix = prefix
        self._colors = colors
        self._shown: Mapping[str, Color] = {}

    def show(self) -> None:
        """Show the present lights; for the drawing thread."""
        colors = self._colors()
        if colors == self._shown:
            return
        self._shown = colors
        for light, color in colors.items():
            material = mujoco.mj_name2id(
                self._mj, mujoco.mjtObj.mjOBJ_MATERIAL, self._prefix + lamp_material(light)
            )
            if material >= 0:
                look = look_of(color)
                self._mj.mat_rgba[material, :3] = look.color
                self._mj.mat_emission[material] = look.emission


def paint(mj: mujoco.MjModel, geoms: NDArray[np.intp], color: Sequence[float]) -> None:
    """Give some geoms, except lamps, a color instead of those of their materials."""
    for geom in geoms.tolist():
        material = int(mj.geom_matid[geom])
        if material < 0 or lamp_material("") not in mj.material(material).name:
            mj.geom_rgba[geom] = (*color, 1.0)


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
