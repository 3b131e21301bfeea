"""Export the visible shapes of the body, for viewers without MuJoCo.

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
from naoserver_sim.appearance import Shape, read_meshes, read_skin
from naoserver_sim.world import BALL_RADIUS, DEFAULT_WORLD, load_world

__all__ = ["describe_body"]

MESH_UNIT: Final = 1e-4
"""Metres in a unit of a mesh's vertices."""
_DIGITS: Final = 5


def describe_body() -> dict[str, Any]:
    """Return the body and the balls as plain data."""
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
    meshes = read_meshes()
    numbers = {name: number for number, name in enumerate(meshes)}
    return {
        "generatedBy": "python -m naoserver_sim.geometry, from the facts and the skin of the H25",
        "meshUnit": MESH_UNIT,
        "links": links,
        "shapes": [
            {"link": link, **_form(shape, numbers, mirrored=mirrored), **_look(shape, mirrored=mirrored)}
            for shape in read_skin().looks.shell
            for link, mirrored in shape.places()
        ],
        "meshes": [
            {
                "vertices": _base64(np.round(mesh.vertices / MESH_UNIT).astype("<i2")),
                "indices": _base64(mesh.faces.astype("<u2")),
            }
            for mesh in meshes.values()
        ],
        "soles": soles,
        "balls": {
            ball.name: {"radius": BALL_RADIUS, "color": list(ball.color)}
            for ball in load_world(DEFAULT_WORLD).carried_balls
        },
    }


def _form(shape: Shape, meshes: dict[str, int], *, mirrored: bool) -> dict[str, Any]:
    if shape.kind == "mesh":
        return {"kind": "mesh", "mesh": meshes[shape.mesh], "mirrored": mirrored}
    mirror = np.array([1.0, -1.0 if mirrored else 1.0, 1.0])
    size, place, axis = [*shape.size, 0.0, 0.0][:3], mirror * shape.at, mirror * shape.normal
    if shape.kind == "capsule":
        end = mirror * shape.to
        place, axis = (place + end) / 2, place - end
        size[1] = float(np.linalg.norm(axis)) / 2
    quat = np.zeros(4)
    mujoco.mju_quatZ2Vec(quat, axis / np.linalg.norm(axis))
    w, x, y, z = quat
    return {
        "kind": {"disc": "cylinder"}.get(shape.kind, shape.kind),
        "size": _rounded(size),
        "position": _rounded(place),
        "quaternion": _rounded((x, y, z, w)),
    }


def _look(shape: Shape, *, mirrored: bool) -> dict[str, Any]:
    look = shape.look(mirrored=mirrored)
    glow = {"glow": round(look.emission, 3)} if look.emission > 0 else {}
    return {"color": [round(value, 3) for value in look.color], **glow}


def _rounded(values: Any) -> list[float]:  # noqa: ANN401 - an array, or numbers
    return [round(float(value), _DIGITS) + 0.0 for value in values]


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode()


def main(file: Path) -> None:
    """Write the body as JSON."""
    file.write_text(json.dumps(describe_body(), separators=(",", ":")) + "\n", encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
