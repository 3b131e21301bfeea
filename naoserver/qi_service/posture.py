"""ALRobotPosture: the postures of the whole body."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from naoserver.qi_service.calls import Call, long_call
from naoserver.qi_service.postures import Postures
from naoserver.qi_service.values import fraction, text

__all__ = ["ALRobotPosture"]

FAMILIES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "Crouch": "Crouching",
        "LyingBack": "LyingBack",
        "LyingBelly": "LyingBelly",
        "Sit": "Sitting",
        "SitRelax": "Sitting",
        "Stand": "Standing",
        "StandInit": "Standing",
        "StandZero": "Standing",
    }
)
"""The family of each posture."""
UNKNOWN: Final = "Unknown"


class ALRobotPosture:
    """Go into postures, and tell in which the robot is."""

    def __init__(self, postures: Postures) -> None:
        self._postures = postures

    @long_call
    def goToPosture(self, call: Call, postureName: object, maxSpeedFraction: object) -> bool:
        """Go to a posture at a fraction of the full pace; returns at its end whether it came there."""
        return self._postures.go(
            call, text(postureName, "posture"), fraction(maxSpeedFraction, "the fraction")
        )

    @long_call
    def applyPosture(self, call: Call, postureName: object, maxSpeedFraction: object) -> bool:
        """Go to a posture, as goToPosture does."""
        return self.goToPosture(call, postureName, maxSpeedFraction)

    def stopMove(self) -> None:
        """Stop on the way to a posture."""
        self._postures.stop()

    def getPosture(self) -> str:
        """Return the posture in which the robot is, or `Unknown`."""
        return self._postures.current() or UNKNOWN

    def getPostureFamily(self) -> str:
        """Return the family of the posture in which the robot is, such as `Standing`."""
        return FAMILIES.get(self._postures.current(), UNKNOWN)

    def getPostureList(self) -> list[str]:
        """Return the names of the postures."""
        return list(self._postures.names)

    def getPostureFamilyList(self) -> list[str]:
        """Return the names of the families."""
        return sorted({FAMILIES[name] for name in self._postures.names})
