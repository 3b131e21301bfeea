"""What a person sees of the robot: the bare blocks, or a skin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import mujoco

VISUAL_GROUP: Final = 1
_BLOCK: Final = (0.75, 0.76, 0.78, 1.0)
_DARK: Final = (0.3, 0.32, 0.35, 1.0)

# Half sizes and places in m of the boxes of the links on the left; the right ones are their mirror images.
_BOXES: Final = {
    "torso": ((0.045, 0.06, 0.095), (0.0, 0.0, 0.02)),
    "l_upper_arm": ((0.0525, 0.03, 0.03), (0.05, 0.01, 0.0)),
    "l_forearm": ((0.028, 0.03, 0.03), (0.028, 0.0, 0.0)),
    "l_wrist_hand": ((0.035, 0.02, 0.02), (0.04, 0.0, 0.0)),
    "l_thigh": ((0.035, 0.035, 0.05), (0.0, 0.0, -0.05)),
    "l_tibia": ((0.035, 0.03, 0.05), (0.0, 0.0, -0.05)),
    "l_foot": ((0.075, 0.044, 0.02), (0.024, 0.006, -0.025)),
}


def add_blocks(spec: mujoco.MjSpec, links: Mapping[str, mujoco.MjsBody]) -> None:
    """Show the mechanical blocks: a box for each limb and a sphere for the head."""
    del spec
    for name, (size, (x, y, z)) in _BOXES.items():
        for side, sign in ((name, 1), ("r" + name[1:], -1)) if name[1] == "_" else ((name, 1),):
            _add(links[side], mujoco.mjtGeom.mjGEOM_BOX, size, (x, sign * y, z), _BLOCK)
    _add(links["head"], mujoco.mjtGeom.mjGEOM_SPHERE, (0.062, 0, 0), (0, 0, 0.052), _BLOCK)
    for side in ("l", "r"):
        for joint in ("shoulder", "elbow", "hip", "ankle"):
            _add(links[f"{side}_{joint}"], mujoco.mjtGeom.mjGEOM_SPHERE, (0.028, 0, 0), (0, 0, 0), _DARK)


def _add(link: Any, kind: Any, size: Any, pos: Any, rgba: Any) -> None:
    link.add_geom(
        type=kind, size=size, pos=pos, rgba=rgba, group=VISUAL_GROUP, contype=0, conaffinity=0, mass=0
    )


add_skin = add_blocks
