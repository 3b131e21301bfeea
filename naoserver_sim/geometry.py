"""Write down what is seen of the body, for viewers that know nothing of MuJoCo.

`python -m naoserver_sim.geometry FILE` writes the links with their joints, their visible shapes in the links'
frames, and the balls, as JSON. Lengths in m, quaternions as (x, y, z, w), colors as red, green, blue from 0
to 1; what has a `glow`, from 0 to 1, shines by itself. Sizes are halves: half axes of an ellipsoid, half
sides of a box; radius and half length, along z, of a cylinder and of a capsule without its ends. The vertices
of meshes are int16 in units of 0.1 mm and their indices uint16, both little-endian in base64; a shape that is
`mirrored` is one with y turned round.
"""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
import typer
from numpy.typing import NDArray

from naoserver.body import H25
from naoserver_sim.appearance import VISUAL_GROUP
from naoserver_sim.model import build_model
from naoserver_sim.world import BALL_RADIUS, DEFAULT_WORLD, load_world

__all__ = ["describe_body"]

MESH_UNIT: Final = 1e-4
"""Metres in a unit of a mesh's vertices."""
_SAME: Final = 1.5
"""Units within which the vertices of mirrored meshes agree."""
_DIGITS: Final = 5
_KINDS: Final = {
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
    mujoco.mjtGeom.mjGEOM_BOX: "box",
    mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
}


def describe_body() -> dict[str, Any]:
    """Return the body and the balls as plain data."""
    model = build_model().mj
    meshes = _Meshes(model)
    shapes = [
        _shape(model, number, meshes)
        for number in range(model.ngeom)
        if model.geom_group[number] == VISUAL_GROUP
    ]
    joints = {joint.child: joint for joint in H25.joints}
    links = []
    for link in H25.links:
        joint = joints.get(link.name)
        described: dict[str, Any] = {"name": link.name}
        if joint is not None:
            described |= {"parent": joint.parent, "joint": joint.name}
            described |= {"axis": list(joint.axis), "origin": list(joint.origin)}
        links.append(described)
    soles = {
        f"{side[0]}_foot": [[*point, -H25.facts["dimensions"]["foot_height"]] for point in outline]
        for side, outline in H25.facts["sole"].items()
        if side in ("left", "right")
    }
    return {
        "generatedBy": "python -m naoserver_sim.geometry, from the facts and the skin of the H25",
        "meshUnit": MESH_UNIT,
        "links": links,
        "shapes": shapes,
        "meshes": meshes.described,
        "soles": soles,
        "balls": {
            ball.name: {"radius": BALL_RADIUS, "color": list(ball.color)}
            for ball in load_world(DEFAULT_WORLD).carried_balls
        },
    }


class _Meshes:
    """The meshes of a model in units, each once: of a pair of mirror images only one."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._vertices: list[NDArray[np.float64]] = []
        self.described: list[dict[str, str]] = []

    def add(self, geom: int) -> tuple[int, bool]:
        """Return the number of the mesh of a geom in the frame of its link, and whether it is mirrored."""
        model, mesh = self._model, self._model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        points = model.mesh_vert[first : first + count] @ turn.reshape(3, 3).T + model.geom_pos[geom]
        points = points / MESH_UNIT
        for number, known in enumerate(self._vertices):
            for mirrored in (False, True):
                image = known * [1, -1, 1] if mirrored else known
                if image.shape == points.shape and np.abs(image - points).max() < _SAME:
                    return number, mirrored
        first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        self._vertices.append(points)
        self.described.append(
            {
                "vertices": _base64(np.round(points).astype("<i2")),
                "indices": _base64(model.mesh_face[first : first + count].astype("<u2")),
            }
        )
        return len(self._vertices) - 1, False


def _shape(model: mujoco.MjModel, geom: int, meshes: _Meshes) -> dict[str, Any]:
    link = model.body(model.geom_bodyid[geom]).name
    material = model.geom_matid[geom]
    look: dict[str, Any] = {"color": [round(float(value), 3) for value in model.mat_rgba[material][:3]]}
    if model.mat_emission[material] > 0:
        look["glow"] = round(float(model.mat_emission[material]), 3)
    kind = mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh, mirrored = meshes.add(geom)
        return {"link": link, "kind": "mesh", "mesh": mesh, "mirrored": mirrored, **look}
    w, x, y, z = model.geom_quat[geom]
    return {
        "link": link, "kind": _KINDS[kind], "size": _rounded(model.geom_size[geom]),
        "position": _rounded(model.geom_pos[geom]), "quaternion": _rounded((x, y, z, w)), **look,
    }  # fmt: skip


def _rounded(values: Any) -> list[float]:  # noqa: ANN401 - an array of MuJoCo's
    return [round(float(value), _DIGITS) + 0.0 for value in values]


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode()


def main(file: Path) -> None:
    """Write the body as JSON."""
    file.write_text(json.dumps(describe_body(), separators=(",", ":")) + "\n", encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
