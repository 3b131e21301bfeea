"""What the services read, and by which guarded ways they command."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from naoserver.assembly import Assembly
from naoserver.guarded_device import GuardedDevice
from naoserver.robot import Robot

__all__ = ["Access"]


@dataclass(frozen=True, slots=True)
class Access:
    """A robot, and the guards before whatever moves it."""

    robot: Robot
    body: GuardedDevice
    """Its joints."""

    @classmethod
    def through(cls, robot: Robot, assembly: Assembly) -> Self:
        """Return the access that goes through the guards of an assembly."""
        return cls(robot, assembly.body)
