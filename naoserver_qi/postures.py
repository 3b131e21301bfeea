"""ALRobotPosture and ALBehaviorManager: postures of the whole body, and the server's motions as behaviors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from interfaces.nao import ActionStatus
from naoserver.motions.keyframes import Motion, load_motions
from naoserver.motions.postures import nearest_posture
from naoserver.motions.routes import MotionRoute
from naoserver.servants.motions import MOTION, POSTURE
from naoserver_qi.access import Access, Service
from naoserver_qi.arguments import chosen, constant, fraction, kept, text, texts, within
from naoserver_qi.clients import Activity, Call, Client, begins, begins_any
from naoserver_qi.modules import LOOK

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
POSES: Final[Mapping[str, str]] = {
    "Crouch": "Crouch",
    "LyingBack": "Back",
    "LyingBelly": "Belly",
    **dict.fromkeys(("Sit", "SitRelax"), "Sit"),
    **dict.fromkeys(("Stand", "StandInit", "StandZero"), "Stand"),
}
"""What NAOqi 1 calls each posture."""


class ALRobotPosture(Service):
    """Go into postures, and report the current one."""

    @begins(Activity.POSTURE)
    def goToPosture(self, call: Call, postureName: object, maxSpeedFraction: object) -> bool:
        """End a walk, and go to a posture at a fraction of full pace; returns whether it was reached."""
        postures = self._access.postures
        name = chosen(postureName, "posture", postures.names)
        pace = fraction(maxSpeedFraction, "the fraction")
        self._access.free(call)
        with self._access.calls.beginning(call) as may:
            if not may:
                return False
            postures.go(name, pace, call.client.name)
            count = postures.progress().count
        while (now := postures.progress()).status is ActionStatus.Moving and now.count == count:
            if call.wait(LOOK):
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
        return nearest_posture(self._access.player.situation()) or UNKNOWN

    def _pose(self) -> str:
        """Return what NAOqi 1 calls the current posture."""
        return POSES.get(self.getPosture(), UNKNOWN)

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

    setDefaultBehaviors, getDefaultBehaviors = kept(
        "the behaviors that a robot runs when it starts", [], behaviors=texts
    )

    @begins(Activity.BEHAVIOR)
    def runBehavior(self, call: Call, name: object) -> None:
        """Run a behavior; returns at its end. Whatever else moves the body is stopped first."""
        motion = self._motion(name)
        self._access.free(call)
        with self._access.calls.beginning(call) as may:
            if not may:
                return
            count = self._start(motion, call.client)
        while motion.name in self.getRunningBehaviors() and self._player.progress(MOTION).count == count:
            if call.wait(LOOK):
                if not call.client.gone and self._player.progress(MOTION).count == count:
                    self._player.stop(MOTION)
                return

    @begins(Activity.BEHAVIOR)
    def startBehavior(self, name: object) -> None:
        """Start a behavior; returns at once."""
        motion, calls = self._motion(name), self._access.calls
        with calls.beginning() as may:
            if may:
                self._start(motion, calls.current.client)

    def stopBehavior(self, name: object) -> None:
        """Stop a behavior."""
        motion = self._motion(name)
        chosen = begins_any(Activity.BEHAVIOR)
        with self._access.calls.stopping(lambda call: chosen(call) and call.arguments[:1] == (name,)):
            if motion.name in self.getRunningBehaviors():
                self._player.stop(MOTION)

    def stopAllBehaviors(self) -> None:
        """Stop the running behavior, and those that are about to start."""
        with self._access.calls.stopping(begins_any(Activity.BEHAVIOR)):
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

    def _start(self, motion: Motion, client: Client) -> int:
        """Start a behavior; return the count of the player."""
        route = MotionRoute(motion, load_motions().values())
        self._player.begin(MOTION, motion.name, route, client=client.name)
        return self._player.progress(MOTION).count

    def _motion(self, name: object) -> Motion:
        motions = load_motions()
        return motions[chosen(name, "behavior", motions)]
