"""ALRobotPosture, and ALRobotPose of NAOqi 1: postures of the whole body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from interfaces.nao import ActionStatus
from naoserver._motions.routes import nearest_posture
from naoserver._servants.moves import POSTURE
from naoserver.qi._access import Access, Service
from naoserver.qi._arguments import chosen, constant, fraction, number, within
from naoserver.qi._clients import Activity, Call, begins, begins_any
from naoserver.qi._modules import CHECK_PERIOD

UNKNOWN: Final = "Unknown"
_NAMES: Final[Mapping[str, tuple[str, str]]] = {
    "Crouch": ("Crouching", "Crouch"),
    "LyingBack": ("LyingBack", "Back"),
    "LyingBelly": ("LyingBelly", "Belly"),
    **dict.fromkeys(("Sit", "SitRelax"), ("Sitting", "Sit")),
    **dict.fromkeys(("Stand", "StandInit", "StandZero"), ("Standing", "Stand")),
}
"""The family of each posture, and what NAOqi 1 calls it."""


class ALRobotPosture(Service):
    """Go into postures, and report the current one."""

    @begins(Activity.POSTURE)
    def goToPosture(self, call: Call, postureName: object, maxSpeedFraction: object) -> bool:
        """End a walk, and go to a posture at a fraction of full pace; returns whether it was reached.

        A fraction above 1 means full pace, as on a robot.
        """
        postures = self._access.postures
        name = chosen(postureName, "posture", postures.names)
        pace = fraction(min(number(maxSpeedFraction, "the fraction"), 1.0), "the fraction")
        self._access.free(call)
        with self._access.calls.beginning(call) as may:
            if not may:
                return False
            postures.go(name, pace, call.client.name)
            count = postures.progress().count
        while (now := postures.progress()).status is ActionStatus.Moving and now.count == count:
            if call.wait(CHECK_PERIOD):
                if not call.client.gone:  # half way it might fall, while at its end the robot is safe
                    self._end(count)
                return False
        return now.status is ActionStatus.Done and now.count == count

    applyPosture = goToPosture

    setMaxTryNumber = constant("Do nothing: it tries once, or fails.", pMaxTryNumber=within(0, 1000))

    def stopMove(self) -> None:
        """Stop on the way to a posture; calls that wait for the end of a walk no longer go there."""
        with self._access.calls.stopping(begins_any(Activity.POSTURE)):
            self._end(self._access.postures.progress().count)

    def _end(self, count: int) -> None:
        """Stop on the way to a posture, unless it was replaced by a later one."""
        if self._access.postures.progress().count != count:
            return
        if self._robot.postures is not None:
            self._robot.postures.stop()
        else:
            self._access.player.stop(POSTURE)

    def getPosture(self) -> str:
        """Return the current posture, or `Unknown`."""
        if self._robot.postures is not None:
            return self._robot.postures.current() or UNKNOWN
        return nearest_posture(self._robot.body, self._access.player.situation()) or UNKNOWN

    def _pose(self) -> str:
        """Return what NAOqi 1 calls the current posture."""
        return _NAMES.get(self.getPosture(), (UNKNOWN, UNKNOWN))[1]

    def getPostureFamily(self) -> str:
        """Return the family of the current posture, such as `Standing`."""
        return _NAMES.get(self.getPosture(), (UNKNOWN, UNKNOWN))[0]

    def getPostureList(self) -> list[str]:
        """Return the names of the postures."""
        return list(self._access.postures.names)

    def getPostureFamilyList(self) -> list[str]:
        """Return the names of the families."""
        return sorted({_NAMES[name][0] for name in self._access.postures.names})


class ALRobotPose(Service):
    """The current posture under its name in NAOqi 1."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._postures = access.service(ALRobotPosture)
        self._newest = UNKNOWN, self._robot.clock.now()

    def getActualPoseAndTime(self) -> list[object]:
        """Return the current posture, and the seconds since it was first seen here."""
        pose, now = self._postures._pose(), self._robot.clock.now()
        if pose != self._newest[0]:
            self._newest = pose, now
        return [pose, now - self._newest[1]]

    def getPoseNames(self) -> list[str]:
        """Return the names of the postures."""
        return [*dict.fromkeys(pose for _, pose in _NAMES.values()), UNKNOWN]
