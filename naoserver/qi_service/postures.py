"""Go into postures, the way that the servant of the postures knows, and tell which one the body is in."""

from __future__ import annotations

from typing import Final

from interfaces.nao import ActionStatus
from naoserver.errors import InvalidCommand
from naoserver.motions.postures import nearest_posture
from naoserver.qi_service.access import CLIENT, Access
from naoserver.qi_service.calls import Call
from naoserver.qi_service.joint_motion import free
from naoserver.servants.postures import KIND

__all__ = ["Postures"]

_LOOK: Final = 0.05
"""Robot seconds between two looks whether the body has arrived."""


class Postures:
    """The postures of a robot, for calls that last until it is in one."""

    def __init__(self, access: Access) -> None:
        self._access = access

    @property
    def names(self) -> tuple[str, ...]:
        """The postures that the body can be brought into."""
        return self._access.postures.names

    def go(self, call: Call, name: str, pace: float) -> bool:
        """Go to a posture at a fraction of the full pace; return whether the body came there.

        A walk is ended first. Raises InvalidCommand for an unknown posture, RobotError when there is no way.
        """
        postures = self._access.postures
        if name not in postures.names:
            known = ", ".join(postures.names)
            raise InvalidCommand("posture", f"there is no posture {name[:60]!r}; there are {known}")
        free(self._access.body, call)
        if call.stopped.is_set():
            return False
        postures.go(name, pace, CLIENT)
        count = postures.progress().count
        while (now := postures.progress()).status is ActionStatus.Moving and now.count == count:
            if call.wait(_LOOK):
                self.stop()
                return False
        return now.status is ActionStatus.Done and now.count == count

    def stop(self) -> None:
        """Stop on the way."""
        if self._access.robot.postures is not None:
            self._access.robot.postures.stop()
        else:
            self._access.player.stop(KIND)

    def current(self) -> str:
        """Return the posture that the body is in; empty when it is in none."""
        if self._access.robot.postures is not None:
            return self._access.robot.postures.current()
        return nearest_posture(self._access.player.situation())
