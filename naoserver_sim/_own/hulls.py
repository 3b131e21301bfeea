"""The convex hulls of the meshes of a user's model, with few points: the shapes by which its links touch."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.parts import MOST_POINTS

Points = NDArray[np.float64]

_FLAT: Final = 1e-4
"""Extent in m below which points span no volume that MuJoCo takes."""


def coarsen_hulls(spec: mujoco.MjSpec) -> None:
    """Let the compiler give the meshes of a model hulls with at most `MOST_POINTS` corners."""
    for mesh in spec.meshes:
        mesh.maxhullvert = MOST_POINTS


def hull_of(mj: mujoco.MjModel, geom: int) -> Points:
    """Return the corners of the convex hull of a geom's mesh in the frame of its body.

    It has none if it is no mesh that touches, or is flat.
    """
    mesh = int(mj.geom_dataid[geom])
    graph = int(mj.mesh_graphadr[mesh]) if mj.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH else -1
    if graph < 0:
        return np.zeros((0, 3))
    # The numbers of corners and faces, where the edges of each corner begin, and the corners.
    begin, count = graph + 2 + int(mj.mesh_graph[graph]), int(mj.mesh_graph[graph])
    corners = mj.mesh_vert[mj.mesh_vertadr[mesh] + mj.mesh_graph[begin : begin + count]].astype(np.float64)
    if np.linalg.svd(corners - corners.mean(axis=0), compute_uv=False)[-1] < _FLAT:
        return np.zeros((0, 3))
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, mj.geom_quat[geom])
    placed: Points = corners @ turn.reshape(3, 3).T + mj.geom_pos[geom]
    return placed
