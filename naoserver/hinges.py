"""Which joints each hinge's servants move: a hinge is what JdeRobot serves as one Pose3D device."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class Axis(StrEnum):
    """An axis of a Pose3D device, named as the member of the interface that holds it."""

    X = "x"
    Y = "y"
    Z = "z"
    PAN = "pan"
    TILT = "tilt"
    ROLL = "roll"


@dataclass(frozen=True, slots=True)
class Hinge:
    """A group of joints served together as `{name}Motors` and `{name}Encoders`."""

    name: str
    joints: tuple[tuple[Axis, str], ...]
    """The axes that the hinge has, each with its joint."""


def _arm_and_leg(side: str) -> tuple[Hinge, ...]:
    s = side[0]
    return (
        Hinge(f"{side}Shoulder", ((Axis.TILT, f"{s}ShoulderPitch"), (Axis.ROLL, f"{s}ShoulderRoll"))),
        Hinge(f"{side}Elbow", ((Axis.PAN, f"{s}ElbowYaw"), (Axis.ROLL, f"{s}ElbowRoll"))),
        Hinge(f"{side}Wrist", ((Axis.PAN, f"{s}WristYaw"),)),
        Hinge(f"{side}Hand", ((Axis.PAN, f"{s}Hand"),)),
        Hinge(
            f"{side}Hip",
            ((Axis.PAN, f"{s}HipYawPitch"), (Axis.TILT, f"{s}HipPitch"), (Axis.ROLL, f"{s}HipRoll")),
        ),
        Hinge(f"{side}Knee", ((Axis.TILT, f"{s}KneePitch"),)),
        Hinge(f"{side}Ankle", ((Axis.TILT, f"{s}AnklePitch"), (Axis.ROLL, f"{s}AnkleRoll"))),
    )


NECK: Final = Hinge("Neck", ((Axis.PAN, "HeadYaw"), (Axis.TILT, "HeadPitch")))
HINGES: Final = (NECK, *_arm_and_leg("Left"), *_arm_and_leg("Right"))
"""Every hinge of the H25. A hand has one axis, its opening from 0 to 1, served as pan."""

BALL_AXES: Final = (Axis.PAN, Axis.X, Axis.Z)
"""The axes of a ball's three joints in their order: round the robot in rad, distance in m, height in m."""


def ball_hinge(name: str, joints: tuple[str, ...]) -> Hinge:
    """Return the hinge of the ball `name`, whose device has `joints` in the order of `BALL_AXES`."""
    return Hinge(name, tuple(zip(BALL_AXES, joints, strict=True)))
