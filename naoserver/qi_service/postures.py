"""Go into postures and tell which one the body is in."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from naoserver.body import H25
from naoserver.errors import InvalidCommand
from naoserver.qi_service.access import Access
from naoserver.qi_service.calls import Call
from naoserver.qi_service.joint_motion import PERIOD, JointMotion, free
from naoserver.qi_service.trajectory import SmoothTrajectory

__all__ = ["Postures"]

NAMES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "Crouch": "CROUCH",
        "LyingBack": "LYING_BACK",
        "LyingBelly": "LYING_BELLY",
        "Sit": "SIT",
        "SitRelax": "SIT_RELAX",
        "Stand": "STAND",
        "StandInit": "STAND_INIT",
        "StandZero": "STAND_ZERO",
    }
)
"""The names of postures in `naoserver.body` by NAOqi's."""
_NEAR: Final = 0.3
"""Mean difference in rad within which the body counts as being in a posture."""


class Postures:
    """The postures of a robot that has no way of its own into them: straight from angle to angle."""

    def __init__(self, access: Access, motion: JointMotion) -> None:
        self._body = access.body
        self._motion = motion
        self.names: Final = tuple(name for name, facts in NAMES.items() if facts in H25.postures)

    def go(self, call: Call, name: str, pace: float) -> bool:
        """Go to a posture at a fraction of the full pace; return whether the body came there.

        Raises InvalidCommand for an unknown one.
        """
        if name not in self.names:
            raise InvalidCommand("posture", f"there is no posture {name[:60]!r}; there are {self.names}")
        targets = H25.postures[NAMES[name]]
        free(self._body, call)
        with self._motion.task("goToPosture", targets, call) as task:
            commands = self._motion.commands()
            duration = max(
                [
                    PERIOD,
                    *(
                        1.5 * abs(angle - commands[joint]) / (pace * self._body.speed_cap(joint))
                        for joint, angle in targets.items()
                    ),
                ]
            )
            self._motion.follow(
                task,
                {
                    joint: SmoothTrajectory(joint, commands[joint], [duration], [angle])
                    for joint, angle in targets.items()
                },
            )
        return not call.stopped.is_set()

    def stop(self) -> None:
        """Stop on the way."""
        self._motion.stop(task for task in self._motion.tasks() if task.name == "goToPosture")

    def current(self) -> str:
        """Return the posture to which the body is nearest; empty when it is in none."""
        positions = self._body.read().positions
        distances = {
            name: sum(
                abs(positions[self._body.index(joint)] - angle)
                for joint, angle in H25.postures[NAMES[name]].items()
                if not joint.endswith("Hand")
            )
            / len(positions)
            for name in self.names
        }
        nearest = min(distances, key=lambda name: distances[name], default="")
        return nearest if distances.get(nearest, math.inf) < _NEAR else ""
