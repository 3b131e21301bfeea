"""A body of the user's own, from an MJCF or URDF and a TOML file that names its parts.

    model = "my_robot.urdf"             # beside this file; MJCF or URDF
    name = "MyRobot"

    [groups]                            # the joints of each limb, from the trunk outwards
    head = ["pan", "tilt"]

    [hinges.Neck]                       # served as NeckMotors, NeckEncoders, NeckSpeed and Head
    pan = "pan"
    tilt = { joint = "tilt", sign = -1 }

    [[cameras]]
    name = "Camera"
    link = "head"
    horizontal_fov = 1.05

Everything that a facts file describes (`naoserver.body`) may be given; links, joints, contact shapes and
looks come from the model. `[joint.NAME]` corrects what the model says of a joint, `[servo.NAME]` gives some
joints their gains.
"""

from __future__ import annotations

import logging
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import msgspec
import mujoco
import numpy as np

from naoserver.body import LARGEST_DESCRIPTION, Body, write_body
from naoserver.errors import RobotError
from naoserver.looks.description import write_looks
from naoserver_sim._own.looks import looks_in
from naoserver_sim._own.model_file import read_model
from naoserver_sim._own.parts import OwnFile, parts_of
from zenoh_ice.text import printable
from zenoh_ice.toml_file import convert, parse_toml, read_text

_THICKNESS: Final = 0.01
"""Half thickness in m of the box on which a foot stands."""
_CAMERA: Final = {
    "sizes": [[320, 240], [640, 480]],
    "rates": [30.0, 30.0],
    "position": [0, 0, 0],
    "tilt": 0.0,
}
_FROM_THE_MODEL: Final = {"links", "joints", "fixed_joints", "gears", "shapes", "looks"}
_MOST_REPORTED: Final = 5
"""Meshes that are named when they are left out."""

_log = logging.getLogger(__name__)


def read_own_body(path: Path, text: str | None = None) -> Body:
    """Return the body that a TOML file and its model describe; `text` is what the file is to have.

    Raises RobotError with file, line and name when one of them cannot be read or they do not fit together.
    """
    text = read_text(path, RobotError) if text is None else text
    own = parse_toml(text, OwnFile, str(path), RobotError)
    described: dict[str, Any] = {
        key: value for key, value in tomllib.loads(text).items() if key not in OwnFile.__struct_fields__
    }
    if taken := sorted(_FROM_THE_MODEL & described.keys()):
        raise RobotError(
            f"{path}: {taken[0]} come from the model: correct them there, or by [joint] and [servo]"
        )
    model = read_model(path.parent / own.model, path.parent / own.meshes)
    where = str(path.parent / own.model)
    try:
        mj = model.spec.compile()
    except (ValueError, mujoco.FatalError) as problem:
        raise RobotError(f"{where}: {' '.join(str(problem).split())}") from None
    described["name"] = own.name or path.stem
    parts, frames = parts_of(mj, model, own, where)
    described |= parts
    described["shapes"] += _soles(described)
    for camera in described.get("cameras", ()):
        camera |= {key: value for key, value in _CAMERA.items() if key not in camera}
    for hinge in described.get("hinges", {}).values():
        hinge |= {axis: {"joint": of} for axis, of in hinge.items() if isinstance(of, str)}
    body = convert(described, Body, str(path), RobotError, text=text)
    if (size := len(write_body(body))) > LARGEST_DESCRIPTION:
        raise RobotError(f"{path}: its description is too large: {size} bytes, at most {LARGEST_DESCRIPTION}")
    _report(model.left_out, where)
    dressed = msgspec.structs.replace(body, looks=looks_in(mj, frames, body))
    if (size := len(write_looks(dressed))) > LARGEST_DESCRIPTION:
        message = "%s is drawn by its contact shapes: its looks have %d bytes, and at most %d are served"
        _log.warning(message, path, size, LARGEST_DESCRIPTION)
        return body
    return dressed


def _report(left_out: Mapping[str, str], where: str) -> None:
    """Log which meshes are left out."""
    for mesh, why in list(left_out.items())[:_MOST_REPORTED]:
        _log.warning("%s: the mesh %s is left out: %s", where, printable(mesh), why)
    if (more := len(left_out) - _MOST_REPORTED) > 0:
        _log.warning("%s: %d more meshes are left out", where, more)


def _soles(described: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the boxes on which feet stand: round the outlines of their soles."""
    boxes = []
    for side, sole in zip(("left", "right"), described.get("soles", ()), strict=False):
        outline = np.array(sole.get("outline", [[0.0, 0.0]]), np.float64)
        low, high = outline.min(axis=0), outline.max(axis=0)
        size = [*((high - low) / 2).tolist(), _THICKNESS]
        place = [*((high + low) / 2).tolist(), _THICKNESS - sole.get("height", 0.0)]
        box = {"link": sole.get("link", ""), "kind": "box", "size": size, "position": place}
        boxes.append(box | {"name": f"{side}_sole"})
    return boxes
