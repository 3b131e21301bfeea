"""NAOqi's names of joints: each by itself, and the chains that group them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from naoserver.body import H25
from naoserver.errors import InvalidCommand
from naoserver.qi_service.values import texts

__all__ = ["CHAINS", "joints_of"]

JOINTS: Final = H25.joint_names


def _side(side: str, *parts: str) -> tuple[str, ...]:
    return tuple(name for name in JOINTS if name[0] == side and name[1:].startswith(parts))


_ARM = ("Shoulder", "Elbow", "Wrist", "Hand")
_LEG = ("Hip", "Knee", "Ankle")
_LEFT_ARM, _RIGHT_ARM, _LEFT_LEG, _RIGHT_LEG = (
    _side(side, *parts) for parts in (_ARM, _LEG) for side in "LR"
)

CHAINS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "Body": JOINTS,
        "Joints": JOINTS,
        "Actuators": JOINTS,
        "JointActuators": JOINTS,
        "Head": ("HeadYaw", "HeadPitch"),
        "LArm": _LEFT_ARM,
        "RArm": _RIGHT_ARM,
        "Arms": _LEFT_ARM + _RIGHT_ARM,
        "LLeg": _LEFT_LEG,
        "RLeg": _RIGHT_LEG,
        "Legs": _LEFT_LEG + _RIGHT_LEG,
    }
)
"""The joints of each chain, in NAOqi's order."""


def joints_of(names: object) -> tuple[str, ...]:
    """Return the joints that one name or a list of names of joints and chains stand for.

    Raises InvalidCommand for what is neither.
    """
    joints: list[str] = []
    for name in texts(names, "names"):
        if name in CHAINS:
            joints += CHAINS[name]
        elif name in JOINTS:
            joints.append(name)
        else:
            raise InvalidCommand(name[:60], f"there is no joint or chain {name[:60]!r}")
    return tuple(joints)
