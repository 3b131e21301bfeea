"""Paint on the links of the body: materials, shells and primitives that are seen and never touched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Final

import mujoco
import numpy as np

from naoserver_sim.lamps import add_lamp_materials, lamp_material
from naoserver_sim.mesh import Mesh

VISUAL_GROUP: Final = 1
"""The geoms of this group are what the cameras see of the robot."""

Vector = tuple[float, float, float]


class Material(Enum):
    """Colors (red, green, blue), specular and shininess, each 0 to 1, and emission."""

    WHITE = ((0.93, 0.93, 0.94), 0.6, 0.8, 0.0)
    LIGHT_GREY = ((0.80, 0.81, 0.83), 0.4, 0.6, 0.0)
    GREY = ((0.42, 0.44, 0.47), 0.2, 0.3, 0.0)
    DARK = ((0.16, 0.17, 0.19), 0.2, 0.4, 0.0)
    BLACK = ((0.03, 0.03, 0.04), 0.6, 0.9, 0.0)
    # As far from red as orange goes: who looks for a red ball must not find the robot's own body.
    ORANGE = ((0.98, 0.56, 0.05), 0.5, 0.7, 0.0)

    def __init__(self, rgb: Vector, specular: float, shininess: float, emission: float) -> None:
        self.rgb = rgb
        self.specular = specular
        self.shininess = shininess
        self.emission = emission


class Painter:
    """Add what is seen to the links of a body.

    What is painted on a link of the left side (`l_...`) is painted on the right one, too, mirrored. On a link
    in the middle `twice=True` adds the mirror image. Lengths in m in the link's frame.
    """

    def __init__(self, spec: mujoco.MjSpec, links: Mapping[str, mujoco.MjsBody]) -> None:
        self._spec = spec
        self._links = links
        self._meshes = 0
        add_lamp_materials(spec)
        for material in Material:
            spec.add_material(
                name=material.name,
                rgba=[*material.rgb, 1.0],
                specular=material.specular,
                shininess=material.shininess,
                emission=material.emission,
            )

    def shell(self, link: str, mesh: Mesh, material: Material, *, twice: bool = False) -> None:
        """Add a mesh."""
        for place, mirror in self._places(link, twice=twice):
            name = f"{place}_{self._meshes}"
            self._meshes += 1
            side = mesh.mirrored() if mirror else mesh
            self._spec.add_mesh(
                name=name,
                uservert=side.vertices.flatten(),
                userface=side.faces.flatten(),
                smoothnormal=True,
                # Of panels, which are open below, no volume can be told.
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            )
            self._add(place, material.name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)

    def ellipsoid(
        self, link: str, half: Vector, at: Vector, material: Material, *, twice: bool = False
    ) -> None:
        """Add an ellipsoid with half axes `half`."""
        for place, mirror in self._places(link, twice=twice):
            kind = mujoco.mjtGeom.mjGEOM_ELLIPSOID
            self._add(place, material.name, type=kind, size=half, pos=_reflected(at, mirror=mirror))

    def box(self, link: str, half: Vector, at: Vector, material: Material) -> None:
        """Add a box with half sides `half`."""
        for place, mirror in self._places(link, twice=False):
            kind = mujoco.mjtGeom.mjGEOM_BOX
            self._add(place, material.name, type=kind, size=half, pos=_reflected(at, mirror=mirror))

    def capsule(self, link: str, radius: float, ends: tuple[Vector, Vector], material: Material) -> None:
        """Add a capsule between the centers of its round ends."""
        for place, mirror in self._places(link, twice=False):
            fromto = [value for end in ends for value in _reflected(end, mirror=mirror)]
            kind = mujoco.mjtGeom.mjGEOM_CAPSULE
            self._add(place, material.name, type=kind, size=[radius, 0, 0], fromto=fromto)

    def disc(
        self,
        link: str,
        size: tuple[float, float],
        at: Vector,
        normal: Vector,
        material: Material,
        *,
        twice: bool = False,
    ) -> None:
        """Add a disc of `size` (radius, thickness) round `at`, with the axis `normal`."""
        for place, mirror in self._places(link, twice=twice):
            self._add_disc(place, size, at, normal, material.name, mirror=mirror)

    def lamp(
        self,
        link: str,
        size: tuple[float, float],
        at: Vector,
        normal: Vector,
        light: str,
        *,
        twice: bool = False,
    ) -> None:
        """Add a disc that shines as a group of lights does: `Chest`, or `Eye` of `LeftEye` and `RightEye`."""
        for place, mirror in self._places(link, twice=twice):
            sided = twice or link.startswith("l_")
            group = f"{'Right' if mirror else 'Left'}{light}" if sided else light
            self._add_disc(place, size, at, normal, lamp_material(group), mirror=mirror)

    def _add_disc(
        self,
        place: str,
        size: tuple[float, float],
        at: Vector,
        normal: Vector,
        material: str,
        *,
        mirror: bool,
    ) -> None:
        quat = np.zeros(4)
        direction = np.array(_reflected(normal, mirror=mirror))
        mujoco.mju_quatZ2Vec(quat, direction / np.linalg.norm(direction))
        self._add(
            place,
            material,
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[size[0], size[1] / 2, 0],
            pos=_reflected(at, mirror=mirror),
            quat=quat,
        )

    def _places(self, link: str, *, twice: bool) -> list[tuple[str, bool]]:
        """Return the links to paint on, each with whether it is the mirror image."""
        if link.startswith("l_"):
            return [(link, False), (f"r_{link[2:]}", True)]
        return [(link, False), (link, True)] if twice else [(link, False)]

    def _add(self, link: str, material: str, **shape: mujoco.mjtGeom | str | Sequence[float]) -> None:
        self._links[link].add_geom(
            material=material, group=VISUAL_GROUP, contype=0, conaffinity=0, mass=0, **shape
        )


def _reflected(vector: Vector, *, mirror: bool) -> Vector:
    x, y, z = vector
    return (x, -y, z) if mirror else vector
