"""The bare mechanical blocks of the robot: a box for each part of a limb, a sphere for the head."""

from __future__ import annotations

from typing import Final

from naoserver_sim.appearance import Material, Painter, Vector

# Half sides and centers in m. Upper arm and forearm have the published 60 x 60 x 105 and 60 x 60 x 55.95 mm.
_BOXES: Final[dict[str, tuple[Vector, Vector]]] = {
    "torso": ((0.045, 0.060, 0.095), (0.0, 0.0, 0.02)),
    "l_upper_arm": ((0.0525, 0.030, 0.030), (0.0525, 0.012, 0.0)),
    "l_forearm": ((0.028, 0.030, 0.030), (0.028, 0.0, 0.0)),
    "l_wrist_hand": ((0.035, 0.020, 0.020), (0.040, 0.0, 0.0)),
    "l_thigh": ((0.035, 0.035, 0.050), (0.0, 0.0, -0.050)),
    "l_tibia": ((0.035, 0.032, 0.048), (0.0, 0.0, -0.052)),
    "l_foot": ((0.075, 0.044, 0.020), (0.0245, 0.0055, -0.025)),
}
_JOINTS: Final = ("l_shoulder", "l_elbow", "l_hip", "l_ankle")
_JOINT_RADIUS: Final = 0.028
_HEAD_RADIUS: Final = 0.062


def paint_blocks(paint: Painter) -> None:
    """Show the blocks."""
    for link, (half, center) in _BOXES.items():
        paint.box(link, half, center, Material.LIGHT_GREY)
    for link in _JOINTS:
        paint.ellipsoid(link, (_JOINT_RADIUS,) * 3, (0.0, 0.0, 0.0), Material.GREY)
    paint.ellipsoid("head", (_HEAD_RADIUS,) * 3, (0.0, 0.0, 0.052), Material.LIGHT_GREY)
