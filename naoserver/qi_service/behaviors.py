"""ALBehaviorManager: the server's motions, as the behaviors that are installed."""

from __future__ import annotations

from typing import Final

from interfaces.nao import ActionStatus
from naoserver.errors import InvalidCommand
from naoserver.motions.keyframes import Motion
from naoserver.motions.library import load_motions
from naoserver.motions.routes import MotionRoute
from naoserver.qi_service.access import CLIENT, Access
from naoserver.qi_service.calls import Call, long_call
from naoserver.qi_service.joint_motion import free
from naoserver.qi_service.values import text
from naoserver.servants.motions import KIND

__all__ = ["ALBehaviorManager"]

_LOOK: Final = 0.05
"""Robot seconds between two looks whether a behavior has ended."""


class ALBehaviorManager:
    """Run motions such as `wave`."""

    def __init__(self, access: Access) -> None:
        self._body = access.body
        self._player = access.player
        self._motions = load_motions()

    @long_call
    def runBehavior(self, call: Call, name: object) -> None:
        """Run a behavior; returns at its end. Whatever else moves the body is ended first."""
        motion = self._motion(name)
        free(self._body, call)
        if call.stopped.is_set():
            return
        self._begin(motion)
        count = self._player.progress(KIND).count
        while motion.name in self.getRunningBehaviors() and self._player.progress(KIND).count == count:
            if call.wait(_LOOK):
                self.stopBehavior(name)

    def startBehavior(self, name: object) -> None:
        """Begin a behavior; returns at once."""
        self._begin(self._motion(name))

    def stopBehavior(self, name: object) -> None:
        """End a behavior."""
        if self._motion(name).name in self.getRunningBehaviors():
            self._player.stop(KIND)

    def stopAllBehaviors(self) -> None:
        """End the behavior that runs."""
        self._player.stop(KIND)

    def getInstalledBehaviors(self) -> list[str]:
        """Return the names of the behaviors."""
        return list(self._motions)

    def getRunningBehaviors(self) -> list[str]:
        """Return the name of the behavior that runs; one at most does."""
        progress = self._player.progress(KIND)
        return [progress.name] if progress.status is ActionStatus.Moving else []

    def isBehaviorInstalled(self, name: object) -> bool:
        """Return whether there is a behavior of a name."""
        return text(name, "name") in self._motions

    def isBehaviorRunning(self, name: object) -> bool:
        """Return whether a behavior runs."""
        return text(name, "name") in self.getRunningBehaviors()

    def _motion(self, name: object) -> Motion:
        motion = self._motions.get(text(name, "name"))
        if motion is None:
            known = ", ".join(self._motions)
            raise InvalidCommand("name", f"there is no behavior {str(name)[:60]!r}; there are {known}")
        return motion

    def _begin(self, motion: Motion) -> None:
        route = MotionRoute(motion, self._motions.values())
        self._player.begin(KIND, motion.name, route, client=CLIENT)
