"""Motions of the legs, as arguments of ALMotion.angleInterpolation, that a robot cannot stand unaided."""

from __future__ import annotations

from typing import Final

__all__ = ["KICK", "ONE_LEG"]

_LEAN: Final = 0.16
"""Roll of ankles and hips in rad that brings the center of mass near the inner edge of the left foot."""
_LEANING: Final = ["LHipRoll", "RHipRoll", "LAnkleRoll", "RAnkleRoll"]
_LIFTED: Final = ["RHipPitch", "RKneePitch", "RAnklePitch"]
_LEANT: Final = [[-_LEAN], [-_LEAN], [_LEAN], [_LEAN]]

ONE_LEG: Final = (
    [*_LEANING, *_LIFTED],
    [*_LEANT, [-0.45, -0.85], [0.7, 1.5], [-0.35, -0.75]],
    [[1.0]] * 4 + [[1.0, 1.8]] * 3,
    True,
)
"""From StandInit: lean to the left, lift the right foot, and stay so."""
KICK: Final = (
    [*_LEANING, *_LIFTED],
    [
        *_LEANT,
        [-0.45, -0.75, -0.35, -1.1, -0.75],
        [0.7, 1.3, 1.5, 0.9, 1.3],
        [-0.35, -0.55, -0.6, -0.2, -0.55],
    ],
    [[1.0]] * 4 + [[1.0, 1.8, 2.2, 2.4, 3.0]] * 3,
    True,
)
"""From StandInit: lean to the left, and swing the right foot back and forwards at full speed."""
