"""What is seen of a user's model: its visual shapes and meshes, in the colors of its materials."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Final, NamedTuple

import mujoco
import numpy as np

from naoserver.bodies.description import GREY, plain_looks, seen
from naoserver.bodies.looks import Looks, Material, Mesh, SeenShape, Shapes, Skin
from naoserver.bodies.parts import MOST_PARTS, SHAPE_SIZES, Shape, ShapeKind
from naoserver.body import Body
from naoserver_sim.appearance import NO_COLOR, color_of
from visualhfsm_own_robots._figure import Array

MOST_TRIANGLES: Final = 40_000
"""Most triangles of a robot's meshes: without a GPU, they determine how long a picture takes."""
MOST_VERTICES: Final = 30_000
"""Most vertices of them: with so many, looks fit into an answer of `Description`."""
_SHOWN_GROUPS: Final = 2
"""MuJoCo's viewer shows the groups up to this one."""
_VISUAL_GROUP: Final = 2
"""The group that is by convention only to be seen."""
_FINEST: Final = 1000
"""Cells of the finest grid along the largest mesh."""
_COARSER: Final = 1.2
KINDS: Final[Mapping[mujoco.mjtGeom, ShapeKind]] = {
    mujoco.mjtGeom.mjGEOM_BOX: "box",
    mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
}
"""The kinds of simple shapes."""
_MESH: Final = mujoco.mjtGeom.mjGEOM_MESH
_FEWEST_VERTICES: Final = 4
"""Of a mesh in MuJoCo."""


class Frame(NamedTuple):
    """The link that a body of a model becomes."""

    link: str
    offset: Array
    """Place of the link's frame in the body's in m."""


def looks_in(
    mj: mujoco.MjModel, frames: Mapping[int, Frame], body: Body, note: Callable[[str], object]
) -> Looks | None:
    """Return what is seen of a compiled model; None if its contact shapes must do. `frames` are its bodies'.

    Of a link, those are the shapes that are only seen; of a link without such, all. Large meshes are
    coarsened, and nothing is seen of a model with too many shapes: `note` gets a sentence about both.
    """
    shown = [geom for of in frames for geom in _shown(mj, of)]
    if len(shown) > MOST_PARTS:
        what = f"it has {len(shown)} visual shapes, and at most {MOST_PARTS} are drawn"
        note(f"{body.name} is drawn by its contact shapes: {what}")
        return None
    surfaces = {geom: _surface(mj, geom) for geom in shown}
    names = {surface: f"surface {number}" for number, surface in enumerate(dict.fromkeys(surfaces.values()))}
    shapes = [_shape(mj, geom, frames, names[surfaces[geom]]) for geom in shown]
    drawn = [shape.mesh for shape in shapes if shape.kind == "mesh"]
    whole = {_mesh_name(mesh): _mesh(mj, mesh) for mesh in range(mj.nmesh)}
    meshes = within_limits({name: whole[name] for name in dict.fromkeys(drawn)}, drawn)
    before, after = (sum(len(of[name].faces) for name in drawn if name in of) for of in (whole, meshes))
    if after < before:
        note(f"{body.name} is drawn with {after} of the {before} triangles of its meshes")
    shell = tuple(shape for shape in shapes if shape.kind != "mesh" or shape.mesh in meshes)
    blocks = plain_looks(body).skin
    materials = {name: surface for surface, name in names.items()}
    return Looks(Skin(materials | blocks.materials, {}, Shapes(shell, blocks.shapes.blocks)), meshes)


def _shown(mj: mujoco.MjModel, body: int) -> list[int]:
    """Return the geoms of a body that are seen."""
    solid = [
        geom
        for geom in np.flatnonzero(mj.geom_bodyid == body).tolist()
        if color_of(mj, geom)[3] > 0.0 and (_kind(mj, geom) == _MESH or _kind(mj, geom) in KINDS)
    ]
    visible = [geom for geom in solid if mj.geom_group[geom] <= _SHOWN_GROUPS]
    visual = {
        int(mj.geom_group[geom])
        for geom in visible
        if mj.geom_group[geom] == _VISUAL_GROUP or not (mj.geom_contype[geom] or mj.geom_conaffinity[geom])
    }
    return [geom for geom in visible if int(mj.geom_group[geom]) in visual] or visible or solid


def _kind(mj: mujoco.MjModel, geom: int) -> mujoco.mjtGeom:
    return mujoco.mjtGeom(int(mj.geom_type[geom]))


def _surface(mj: mujoco.MjModel, geom: int) -> Material:
    """Return how a geom reflects light; one without a color is grey."""
    material = int(mj.geom_matid[geom])
    *color, opacity = color_of(mj, geom)
    if material < 0 and (*color, opacity) == NO_COLOR:
        return GREY
    red, green, blue = (min(max(value, 0.0), 1.0) for value in color)
    if material < 0:
        return Material((red, green, blue), GREY.specular, GREY.shininess, opacity=opacity)
    return Material(
        (red, green, blue),
        float(mj.mat_specular[material]),
        float(mj.mat_shininess[material]),
        float(mj.mat_emission[material]),
        opacity,
    )


def _shape(mj: mujoco.MjModel, geom: int, frames: Mapping[int, Frame], material: str) -> SeenShape:
    link, offset = frames[int(mj.geom_bodyid[geom])]
    x, y, z = (mj.geom_pos[geom] - offset).tolist()
    turn: tuple[float, float, float, float] = tuple(mj.geom_quat[geom].tolist())
    if _kind(mj, geom) == _MESH:
        mesh = _mesh_name(int(mj.geom_dataid[geom]))
        return SeenShape(link, "mesh", material=material, mesh=mesh, at=(x, y, z), turn=turn)
    kind = KINDS[_kind(mj, geom)]
    size = tuple(mj.geom_size[geom][: SHAPE_SIZES[kind]].tolist())
    return seen(Shape(link=link, kind=kind, size=size, position=(x, y, z), turn=turn), material)


def _mesh_name(mesh: int) -> str:
    return f"mesh {mesh}"


def _mesh(mj: mujoco.MjModel, mesh: int) -> Mesh:
    vertex, face = int(mj.mesh_vertadr[mesh]), int(mj.mesh_faceadr[mesh])
    vertices = mj.mesh_vert[vertex : vertex + int(mj.mesh_vertnum[mesh])].astype(np.float64)
    return Mesh(vertices, mj.mesh_face[face : face + int(mj.mesh_facenum[mesh])].copy(), smooth=False)


def within_limits(meshes: Mapping[str, Mesh], drawn: Iterable[str]) -> Mapping[str, Mesh]:
    """Return meshes with so few vertices and triangles that they can be drawn; `drawn` names each use.

    The vertices in a cell of a grid become one, with the finest grid that does it: vertex clustering
    (Rossignac and Borrel, 1993). What vanishes in it is left out.
    """
    uses = list(drawn)
    size = max((float(np.ptp(mesh.vertices, axis=0).max()) for mesh in meshes.values()), default=0.0)
    cell = size / _FINEST
    while (
        sum(len(meshes[name].faces) for name in uses if name in meshes) > MOST_TRIANGLES
        or sum(len(mesh.vertices) for mesh in meshes.values()) > MOST_VERTICES
    ):
        coarser = {name: _clustered(mesh, cell) for name, mesh in meshes.items()}
        meshes = {name: mesh for name, mesh in coarser.items() if len(mesh.vertices) >= _FEWEST_VERTICES}
        # Of a surface, cells twice as large have a fourth of the vertices.
        cell *= max(
            _COARSER, 0.8 * math.sqrt(sum(len(mesh.vertices) for mesh in meshes.values()) / MOST_VERTICES)
        )
    return meshes


def _clustered(mesh: Mesh, cell: float) -> Mesh:
    """Return a mesh in which all vertices in a cell of a grid are one, in their middle."""
    vertices, faces, smooth = mesh
    places = np.floor((vertices - vertices.min(axis=0)) / cell).astype(np.int64)
    keys = np.ravel_multi_index(tuple(places.T), tuple(places.max(axis=0) + 1))
    _, cluster, counts = np.unique(keys, return_inverse=True, return_counts=True)
    sums = [np.bincount(cluster, weights=vertices[:, axis]) for axis in range(3)]
    middles = np.stack(sums, axis=1) / counts[:, None]
    corners = cluster[faces]
    # The same triangles have the same corners in the same order, from the first one.
    corners = np.take_along_axis(corners, (corners.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    shape = (len(middles),) * 3
    distinct = np.stack(np.unravel_index(np.unique(np.ravel_multi_index(corners.T, shape)), shape), axis=1)
    used, renamed = np.unique(distinct, return_inverse=True)
    return Mesh(middles[used], renamed.reshape(-1, 3).astype(np.int32), smooth)
