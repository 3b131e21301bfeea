"""What the services read, and by which guarded ways they command."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Self

from naoserver.assembly import Assembly
from naoserver.guarded_device import GuardedDevice
from naoserver.motions.player import MotionPlayer
from naoserver.robot import Robot
from naoserver.servants.postures import PosturesI
from naoserver.walk_guard import WalkGuard

__all__ = ["CLIENT", "Access"]

CLIENT: Final = "NAOqi"
"""Who commands, as guards know it: libqi does not tell its clients apart. It holds no lease."""


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
