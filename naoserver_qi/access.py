"""What the services read, and the guarded ways by which they command."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Self

from naoserver.assembly import Assembly
from naoserver.guarded_device import GuardedDevice
from naoserver.motions.player import MotionPlayer
from naoserver.robot import Robot
from naoserver.servants.motions import PosturesI
from naoserver.walk_guard import WalkGuard
from naoserver_qi.calls import Call

__all__ = ["CLIENT", "PERIOD", "Access"]

CLIENT: Final = "NAOqi"
"""The client that guards see: libqi does not distinguish its clients. It holds no lease."""
PERIOD: Final = 0.02
"""Robot seconds between two setpoints: ALMotion's cycle."""
_ENDING: Final = 5.0
"""Robot seconds that a walk or a motion gets to end."""


@dataclass(frozen=True, slots=True)
class Access:
    """A robot, and the guards before whatever moves it."""

    robot: Robot
    body: GuardedDevice
    """Its joints."""
    walk: WalkGuard | None
    """Its walk; None when it has none."""
    player: MotionPlayer
    """What plays motions."""
    postures: PosturesI
    """What brings it into postures."""

    @classmethod
    def through(cls, robot: Robot, assembly: Assembly) -> Self:
        """Return the access that goes through the guards of an assembly."""
        walk = next((watched for watched in assembly.watched if isinstance(watched, WalkGuard)), None)
        postures = assembly.servants["Postures"]
        assert isinstance(postures, PosturesI)
        return cls(robot, assembly.body, walk, assembly.player, postures)

    def free(self, call: Call) -> None:
        """End the walk, or whatever else moves joints by itself, and wait until no joint is claimed.

        Returns anyway after some seconds, and when the call is cancelled.
        """
        joints = [joint.name for joint in self.body.joints]
        for _ in range(round(_ENDING / PERIOD)):
            if not self.body.claims.stop(joints) or call.wait(PERIOD):
                return

    def angles(self, *, measured: bool) -> dict[str, float]:
        """Return the measured angle or the setpoint of every joint in rad."""
        reading = self.body.read()
        values = reading.positions if measured else reading.commands
        return {joint.name: value for joint, value in zip(self.body.joints, values, strict=True)}
