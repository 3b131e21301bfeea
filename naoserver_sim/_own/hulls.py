"""The convex hulls of the meshes of a user's model, with few points: the shapes by which its links touch."""

from __future__ import annotations

from itertools import product
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.parts import MOST_POINTS

Points = NDArray[np.float64]

_FLAT: Final = 1e-4
"""Extent in m below which points span no volume that MuJoCo takes."""


def hull_of(mj: mujoco.MjModel, geom: int) -> Points:
    """Return at most `MOST_POINTS` corners of the convex hull of a geom's mesh, in the frame of its body.

    Of a finer hull they are the outermost in all directions and then those farthest from these. It has no
    points if the mesh is flat or is not there.
    """
    mesh = int(mj.geom_dataid[geom])
    if mj.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH or mesh < 0:
        return np.zeros((0, 3))
    first = int(mj.mesh_vertadr[mesh])
    points = mj.mesh_vert[first : first + int(mj.mesh_vertnum[mesh])].astype(np.float64)
    graph = int(mj.mesh_graphadr[mesh])
    if graph >= 0:  # numbers of vertices and faces, the beginnings of the vertices' edges, the vertices
        count = int(mj.mesh_graph[graph])
        points = points[mj.mesh_graph[graph + 2 + count : graph + 2 + 2 * count]]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, mj.geom_quat[geom])
    points = np.unique(points, axis=0)
    if np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[-1] < _FLAT:
        return np.zeros((0, 3))
    corners: Points = _outermost(points) @ turn.reshape(3, 3).T + mj.geom_pos[geom]
    return corners


def _outermost(points: Points) -> Points:
    """Return at most `MOST_POINTS` of the points."""
    if len(points) <= MOST_POINTS:
        return points
    size = np.ptp(points, axis=0)
    ways = np.array([way for way in product((-1, 0, 1), repeat=3) if any(way)]) / size
    kept = list(dict.fromkeys((points @ ways.T).argmax(axis=0).tolist()))
    distance = np.linalg.norm(points[:, None] - points[kept], axis=2).min(axis=1)
    while len(kept) < MOST_POINTS:
        kept.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[kept[-1]], axis=1))
    return points[kept]
