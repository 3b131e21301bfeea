"""ALRobotPosture and ALBehaviorManager: postures of the whole body, and the server's motions as behaviors."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Final

from interfaces.nao import ActionStatus
from naoserver.motions.keyframes import Motion, load_motions
from naoserver.motions.player import MotionRoute
from naoserver.motions.postures import nearest_posture
from naoserver.servants.motions import MOTION, POSTURE
from naoserver_qi.access import CLIENT, Access, Service
from naoserver_qi.arguments import chosen, constant, fraction, kept, text, texts, within
from naoserver_qi.calls import LOOK, Call

FAMILIES: Final[Mapping[str, str]] = {
    "Crouch": "Crouching",
    "LyingBack": "LyingBack",
    "LyingBelly": "LyingBelly",
    "Sit": "Sitting",
    "SitRelax": "Sitting",
    **dict.fromkeys(("Stand", "StandInit", "StandZero"), "Standing"),
}
"""The family of each posture."""
UNKNOWN: Final = "Unknown"


class ALRobotPosture(Service):
    """Go into postures, and report the current one."""

    _stopped = 0.0  # steady wall time in s of the last `stopMove`

    def goToPosture(self, call: Call, postureName: object, maxSpeedFraction: object) -> bool:
        """End a walk, and go to a posture at a fraction of full pace; returns whether it was reached."""
        postures = self._access.postures
        name = chosen(postureName, "posture", postures.names)
        pace = fraction(maxSpeedFraction, "the fraction")
        self._access.free(call)
        if call.stopped.is_set() or call.begun < self._stopped:
            return False
        postures.go(name, pace, CLIENT)
        count = postures.progress().count
        while (now := postures.progress()).status is ActionStatus.Moving and now.count == count:
            if call.wait(LOOK):
                self._end()
                return False
        return now.status is ActionStatus.Done and now.count == count

    applyPosture = goToPosture

    setMaxTryNumber = constant("Do nothing: it tries once, or fails.", pMaxTryNumber=within(0, 1000))

    def stopMove(self) -> None:
        """Stop on the way to a posture; calls that wait for the end of a walk no longer go there."""
        self._stopped = time.monotonic()
        self._end()

    def _end(self) -> None:
        if self._robot.postures is not None:
            self._robot.postures.stop()
        else:
            self._access.player.stop(POSTURE)

    def getPosture(self) -> str:
        """Return the current posture, or `Unknown`."""
        if self._robot.postures is not None:
            return self._robot.postures.current() or UNKNOWN
        return nearest_posture(self._access.player.situation()) or UNKNOWN

    def getPostureFamily(self) -> str:
        """Return the family of the current posture, such as `Standing`."""
        return FAMILIES.get(self.getPosture(), UNKNOWN)

    def getPostureList(self) -> list[str]:
        """Return the names of the postures."""
        return list(self._access.postures.names)

    def getPostureFamilyList(self) -> list[str]:
        """Return the names of the families."""
        return sorted({FAMILIES[name] for name in self._access.postures.names})


class ALBehaviorManager(Service):
    """Run motions such as `wave`."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._player = access.player
        self._stopped: dict[str, float] = {}  # steady wall time in s of the last stop, by behavior

    setDefaultBehaviors, getDefaultBehaviors = kept(
        "the behaviors that a robot runs when it starts", [], behaviors=texts
    )

    def runBehavior(self, call: Call, name: object) -> None:
        """Run a behavior; returns at its end. Whatever else moves the body is stopped first."""
        motion = self._motion(name)
        self._access.free(call)
        if call.stopped.is_set() or call.begun < self._stopped.get(motion.name, 0.0):
            return
        self.startBehavior(name)
        count = self._player.progress(MOTION).count
        while motion.name in self.getRunningBehaviors() and self._player.progress(MOTION).count == count:
            if call.wait(LOOK) and motion.name in self.getRunningBehaviors():
                self._player.stop(MOTION)

    def startBehavior(self, name: object) -> None:
        """Start a behavior; returns at once."""
        motion = self._motion(name)
        route = MotionRoute(motion, load_motions().values())
        self._player.begin(MOTION, motion.name, route, client=CLIENT)

    def stopBehavior(self, name: object) -> None:
        """Stop a behavior."""
        self._stopped[self._motion(name).name] = time.monotonic()
        if name in self.getRunningBehaviors():
            self._player.stop(MOTION)

    def stopAllBehaviors(self) -> None:
        """Stop the running behavior, and those that are about to start."""
        self._stopped = dict.fromkeys(load_motions(), time.monotonic())
        self._player.stop(MOTION)

    def getInstalledBehaviors(self) -> list[str]:
        """Return the names of the behaviors."""
        return list(load_motions())

    def getRunningBehaviors(self) -> list[str]:
        """Return the name of the behavior that runs; one at most does."""
        progress = self._player.progress(MOTION)
        return [progress.name] if progress.status is ActionStatus.Moving else []

    def addDefaultBehavior(self, behavior: object) -> None:
        """Add a default behavior, which has no effect."""
        self.setDefaultBehaviors([*dict.fromkeys((*self.getDefaultBehaviors(), text(behavior, "behavior")))])

    def removeDefaultBehavior(self, behavior: object) -> None:
        """Remove a default behavior."""
        name = text(behavior, "behavior")
        self.setDefaultBehaviors([each for each in self.getDefaultBehaviors() if each != name])

    def isBehaviorInstalled(self, name: object) -> bool:
        """Return whether there is a behavior of a name."""
        return text(name, "name") in load_motions()

    def isBehaviorRunning(self, name: object) -> bool:
        """Return whether a behavior runs."""
        return text(name, "name") in self.getRunningBehaviors()

    def _motion(self, name: object) -> Motion:
        motions = load_motions()
        return motions[chosen(name, "behavior", motions)]
