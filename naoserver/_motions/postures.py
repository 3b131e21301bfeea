"""The postures of the body, and recognition of the present one.

The angles are NAOqi's (`naoserver.body`). Postures are grouped into stances: within a stance the body goes
from one posture to another without losing its hold; from stance to stance it needs a motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from naoserver.body import H25
from naoserver.errors import RobotError
from naoserver.robot import FALLEN_TILT, Robot


class Stance(StrEnum):
    """The part on which the body rests."""

    STANDING = "standing"
    SITTING = "sitting"
    BELLY = "lying on its belly"
    BACK = "lying on its back"
    LEFT_SIDE = "lying on its left side"
    RIGHT_SIDE = "lying on its right side"


_NAMES: Final = {
    "Stand": ("STAND", Stance.STANDING),
    "StandInit": ("STAND_INIT", Stance.STANDING),
    "StandZero": ("STAND_ZERO", Stance.STANDING),
    "Crouch": ("CROUCH", Stance.STANDING),
    "Sit": ("SIT", Stance.SITTING),
    "SitRelax": ("SIT_RELAX", Stance.SITTING),
    "LyingBelly": ("LYING_BELLY", Stance.BELLY),
    "LyingBack": ("LYING_BACK", Stance.BACK),
}


_OWN: Final = {
    # With its knees as high as in NAOqi's posture the torso leans back, and only its hands support it.
    # In NAOqi's the arms press on the thighs at the limit of their motors, which are hot after half a minute.
    "SIT": {
        "ShoulderPitch": 0.75,
        "ShoulderRoll": 0.65,
        "HipYawPitch": -0.6,
        "HipRoll": 0.2,
        "HipPitch": -1.53,
        "KneePitch": 0.5,
        "AnklePitch": 0.4,
        "AnkleRoll": 0.0,
    },
    # The arms rest on the floor beside the body, and do not press against it.
    "SIT_RELAX": {"ShoulderRoll": 0.36},
}
"""Angles of the left side that differ from NAOqi's; those of the right mirror them."""


def _angles(section: str) -> Mapping[str, float]:
    posture = dict(H25.postures[section])
    for name, angle in _OWN.get(section, {}).items():
        posture |= {f"L{name}": angle, f"R{name}": angle if "Pitch" in name else -angle}
    for joint in H25.joints:
        posture[joint.name] = min(max(posture[joint.name], joint.lower), joint.upper)
    for pair in H25.couplings:
        posture[pair.follower] = posture[pair.leader]
    for table in H25.anticollision:
        lower, upper = table.at(posture[table.independent])
        posture[table.dependent] = min(max(posture[table.dependent], lower), upper)
    return posture


POSTURES: Final[Mapping[str, Mapping[str, float]]] = {
    name: _angles(section) for name, (section, _) in _NAMES.items()
}
"""For each posture, an angle in rad of each joint, within its range."""

STANCES: Final[Mapping[str, Stance]] = {name: of for name, (_, of) in _NAMES.items()}
"""The stance of each posture."""

_NEAR: Final = 0.35
"""Largest distance of a joint from its angle in a posture, in rad, for the body to be in it."""
_LEG: Final = ("HipPitch", "KneePitch", "AnklePitch")
_FREE: Final = ("Head", "Wrist", "Hand")
"""Joints that do not count: the body is in its posture however it looks around."""


@dataclass(frozen=True, slots=True)
class Situation:
    """State of the body: its joints, and the upward direction in the torso's frame."""

    joints: Mapping[str, float]
    """Angles in rad by name."""
    up: tuple[float, float, float]
    """Unit vector, as of `InertialReading`."""


def situation_of(robot: Robot) -> Situation:
    """Return the situation of a robot's body; upright if the robot has no inertial unit.

    Raises RobotError when such a robot lies, since its pose is unknown.
    """
    joints = dict(zip((joint.name for joint in robot.joints), robot.read().positions, strict=True))
    if robot.senses is None:
        if robot.state().fallen:
            raise RobotError("the robot has fallen, and has no inertial unit that measures how it lies")
        return Situation(joints, (0.0, 0.0, 1.0))
    return Situation(joints, robot.senses.inertial().up)


def stance_of(situation: Situation) -> Stance:
    """Return the stance, by the body's tilt and, if it is upright, by the pitch joints of its legs."""
    x, y, z = situation.up
    if z < math.cos(FALLEN_TILT):
        if abs(x) >= abs(y):
            return Stance.BELLY if x < 0 else Stance.BACK
        return Stance.LEFT_SIDE if y < 0 else Stance.RIGHT_SIDE
    upright = [name for name, stance in STANCES.items() if stance in (Stance.STANDING, Stance.SITTING)]
    return STANCES[min(upright, key=lambda name: _leg_distance(situation, name))]


def nearest_posture(situation: Situation) -> str:
    """Return the posture that the body is in; empty when it is in none."""
    stance = stance_of(situation)
    distances = [(_distance(situation, name), name) for name, of in STANCES.items() if of is stance]
    distance, nearest = min(distances, default=(math.inf, ""))
    return nearest if distance <= _NEAR else ""


def _leg_distance(situation: Situation, posture: str) -> float:
    joints = [f"{side}{joint}" for side in "LR" for joint in _LEG]
    return sum(abs(situation.joints[joint] - POSTURES[posture][joint]) for joint in joints)


def _distance(situation: Situation, posture: str) -> float:
    angles = POSTURES[posture]
    return max(
        abs(situation.joints[joint] - angle)
        for joint, angle in angles.items()
        if not any(part in joint for part in _FREE)
    )
