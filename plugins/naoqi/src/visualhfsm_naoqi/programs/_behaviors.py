"""Postures of the whole body, motions of the server and animations, under the names of each version of NAOqi.

A motion or an animation is a behavior, which is stopped by stopBehavior and its kin, by whatever stops all
motion, and by the end of its program.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePosixPath
from typing import Final

from interfaces.nao import ActionStatus
from naoserver.errors import InvalidCommand
from naoserver.moves.motion_file import Motion
from naoserver.moves.routes import MotionRoute
from naoserver.serving.moves import MOTION
from visualhfsm_naoqi.programs._access import Access, Service, delegated
from visualhfsm_naoqi.programs._animations import TAGS, AnimationRoute, find_animation, load_animations
from visualhfsm_naoqi.programs._arguments import (
    chosen,
    constant,
    fraction,
    keepable,
    kept,
    number,
    refused,
    text,
    texts,
    within,
)
from visualhfsm_naoqi.programs._clients import CHECK_PERIOD, Activity, Call, Client, begins, begins_any

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
                # Half way it might fall, while at its end the robot is safe.
                if not call.client.gone and postures.progress().count == count:
                    postures.halt()
                return False
        return now.status is ActionStatus.Done and now.count == count

    applyPosture = goToPosture

    setMaxTryNumber = constant("Do nothing: it tries once, or fails.", pMaxTryNumber=within(0, 1000))

    def stopMove(self) -> None:
        """Stop on the way to a posture; calls that wait for the end of a walk no longer go there."""
        with self._access.calls.stopping(begins_any(Activity.POSTURE)):
            self._access.postures.halt()

    def getPosture(self) -> str:
        """Return the current posture, or `Unknown`."""
        return self._access.postures.posture() or UNKNOWN

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


_PACE: Final = 0.8
_FOLDER: Final = PurePosixPath("/home/nao/behaviors")
"""The folder of behaviors on a robot's disk."""
_MOST_PARTS: Final = 8
"""Parts of a behavior's name at most, which are folders."""
_NO_BOXES: Final = "Choregraphe's boxes and timelines are not played here; ALBehaviorManager has behaviors"


class ALBehaviorManager(Service):
    """Run motions such as `wave`, and animations such as `animations/Stand/Gestures/Hey_1`."""

    setDefaultBehaviors, getDefaultBehaviors = kept(
        "the behaviors that a robot runs when it starts", [], behaviors=texts
    )

    @begins(Activity.BEHAVIOR)
    def runBehavior(self, call: Call, name: object) -> None:
        """Run a behavior; returns at its end. Whatever else moves the body is stopped first."""
        motion = self._motion(name)
        self._access.free(call)
        count = self._start(call, motion)
        while self._runs(count):
            if call.wait(CHECK_PERIOD):
                self._halt(call.client, count)
                return

    @begins(Activity.BEHAVIOR)
    def startBehavior(self, name: object) -> None:
        """Start a behavior; returns at once."""
        self._start(self._access.calls.current, self._motion(name))

    def stopBehavior(self, name: object) -> None:
        """Stop a behavior."""
        motion, behaves = self._motion(name), begins_any(Activity.BEHAVIOR)

        def runs_it(call: Call) -> bool:
            named = call.arguments[0] if call.arguments else None
            return behaves(call) and isinstance(named, str) and self._find(named) is motion

        with self._access.calls.stopping(runs_it):
            if motion.name in self.getRunningBehaviors():
                self._access.player.stop(MOTION)

    def stopAllBehaviors(self) -> None:
        """Stop the running behavior, and those that are about to start."""
        with self._access.calls.stopping(begins_any(Activity.BEHAVIOR)):
            self._access.player.stop(MOTION)

    def getInstalledBehaviors(self) -> list[str]:
        """Return the names of the behaviors."""
        return [*self._access.player.motions, *load_animations()]

    def preloadBehavior(self, name: object) -> bool:
        """Do nothing but check that there is a behavior of a name: all are loaded."""
        return self._motion(name) is not None

    def getTagList(self) -> list[str]:
        """Return the tags of the animations."""
        return sorted(TAGS)

    def getBehaviorTags(self, behavior: object) -> list[str]:
        """Return the tags of a behavior."""
        name = self._motion(behavior).name
        return [tag for tag, animation in TAGS.items() if animation == name]

    def getRunningBehaviors(self) -> list[str]:
        """Return the name of the behavior that runs; one at most does."""
        progress = self._access.player.progress(MOTION)
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
        return self._find(text(name, "name")) is not None

    isBehaviorPresent = isBehaviorInstalled  # its former name

    def isBehaviorRunning(self, name: object) -> bool:
        """Return whether a behavior runs."""
        motion = self._find(text(name, "name"))
        return motion is not None and motion.name in self.getRunningBehaviors()

    def _start(self, call: Call, motion: Motion) -> int:
        """Start a behavior for a call; return the count of the player, 0 if the call was stopped."""
        player = self._access.player
        kind = AnimationRoute if motion.name in load_animations() else MotionRoute
        route = kind(player.body, motion, player.motions.values())
        with self._access.calls.beginning(call) as may:
            if not may:
                return 0
            player.begin(MOTION, motion.name, route, client=call.client.name)
            return player.progress(MOTION).count

    def _runs(self, count: int) -> bool:
        """Return whether the behavior with a count of the player runs."""
        progress = self._access.player.progress(MOTION)
        return progress.status is ActionStatus.Moving and progress.count == count

    def _halt(self, client: Client, count: int) -> None:
        """Stop the behavior with a count of the player; that of a lost client is stopped with it."""
        if not client.gone and self._runs(count):
            self._access.player.stop(MOTION)

    def _motion(self, name: object) -> Motion:
        """Return a behavior. Raises InvalidCommand, which lists them."""
        if isinstance(name, str) and (motion := self._find(name)) is not None:
            return motion
        return self._access.player.motions[chosen(name, "behavior", self.getInstalledBehaviors())]

    def _find(self, name: str) -> Motion | None:
        return self._access.player.motions.get(name) or find_animation(name)


class ALAnimationPlayer(Service):
    """Run animations: ALBehaviorManager runs them, too."""

    run = delegated(ALBehaviorManager, ALBehaviorManager.runBehavior)

    @begins(Activity.BEHAVIOR)
    def runTag(self, call: Call, tag: object) -> None:
        """Run the animation of a tag such as `hello`; returns at its end."""
        self._access.service(ALBehaviorManager).runBehavior(call, TAGS[chosen(tag, "tag", TAGS)])

    @begins(Activity.POSTURE)
    def reset(self, call: Call) -> None:
        """Go into the posture `Stand`; returns at its end."""
        self._access.service(ALRobotPosture).goToPosture(call, "Stand", _PACE)

    declarePathForTags = constant("Do nothing: each tag has one animation.", path=text)
    declareTagForAnimations = constant("Do nothing: each tag has one animation.", tagsToAnimations=keepable)
    declareAnimationsPackage = constant("Do nothing: no packages can be installed.", packageUid=text)


_no_boxes: Final = refused(_NO_BOXES)


class ALFrameManager(Service):
    """Run behaviors as NAOqi 1 does; the identifier of a behavior is its name."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._manager = access.service(ALBehaviorManager)

    def newBehaviorFromFile(self, xmlFilePath: object, behName: object) -> str:
        """Return the behavior in whose folder a file is, `wave` for `/home/nao/wave/behavior.xar`."""
        text(behName, "name")
        folder = PurePosixPath(text(xmlFilePath, "file name")).parent
        names = ["/".join(folder.parts[i:]) for i in range(len(folder.parts))]
        for name in names[-_MOST_PARTS:]:
            if self._manager.isBehaviorInstalled(name):
                return name
        raise InvalidCommand("file name", f"{str(folder)[-200:]!r} is the folder of no behavior: {_NO_BOXES}")

    def getBehaviorPath(self, id_: object) -> str:
        """Return the folder of a behavior on the robot's disk, which may be missing there."""
        return f"{_FOLDER / self._manager._motion(id_).name}/"

    def getMotionLength(self, id_: object) -> float:
        """Return the duration of a behavior in s, from the posture in which it begins."""
        return self._manager._motion(id_).duration

    playBehavior = delegated(ALBehaviorManager, ALBehaviorManager.startBehavior)
    completeBehavior = delegated(ALBehaviorManager, ALBehaviorManager.runBehavior)
    exitBehavior = delegated(ALBehaviorManager, ALBehaviorManager.stopBehavior)
    deleteBehavior = stopBehavior = exitBehavior
    cleanBehaviors = delegated(ALBehaviorManager, ALBehaviorManager.stopAllBehaviors)
    isBehaviorRunning = delegated(ALBehaviorManager, ALBehaviorManager.isBehaviorRunning)
    behaviors = delegated(ALBehaviorManager, ALBehaviorManager.getRunningBehaviors)
    newBehavior = newBehaviorFromChoregraphe = createTimeline = _no_boxes
    playTimeline = stopTimeline = gotoAndPlay = gotoAndStop = _no_boxes
