"""Servants of what moves the whole body: the walk, motions made of key frames, and postures.

JdeRobot's `Motors` walk in m/s and rad/s both ways.
"""

from __future__ import annotations

import math
import threading
from abc import abstractmethod
from typing import Final

from interfaces.jderobot import Encoders, EncodersData, Motors
from interfaces.nao import ActionState, ActionStatus, MotionFacts, Motions, Postures, Walk
from naoserver.bodies.capabilities import Odometry, OwnPostures, PostureProgress
from naoserver.errors import CommandRefused
from naoserver.moves._player import MotionPlayer
from naoserver.moves.routes import MotionRoute, PostureRoute, nearest_posture
from naoserver.moves.walk import WalkGuard, WalkTo, way_to
from naoserver.safety._guarded_device import GuardedDevice
from naoserver.serving import _shared as shared
from zenoh_ice import Current
from zenoh_ice.data.text import sentence

_FARTHEST_PLACE: Final = 100.0
"""Largest distance in m along x and y of a place to walk to."""


class MotorsI(Motors):
    """Walk at velocities, each of which must be renewed."""

    def __init__(self, walk: WalkGuard) -> None:
        self._walk = walk

    def getV(self, current: Current) -> float:
        return self._walk.commanded().forward

    def setV(self, v: float, current: Current) -> int:
        shared.require_finite(v=v)
        return self._drive("forward", v, current)

    def getW(self, current: Current) -> float:
        return self._walk.commanded().turn

    def setW(self, w: float, current: Current) -> int:
        shared.require_finite(w=w)
        return self._drive("turn", w, current)

    def getL(self, current: Current) -> float:
        return self._walk.commanded().left

    def setL(self, l: float, current: Current) -> int:  # noqa: E741  (the name in the interface)
        shared.require_finite(l=l)
        return self._drive("left", l, current)

    def stop(self, current: Current) -> None:
        self._walk.stop()

    def _drive(self, kind: str, velocity: float, current: Current) -> int:
        with shared.refusals_raised():
            return 1 if self._walk.drive({kind: velocity}, current.client) else 0


class WalkI(Walk):
    """Walk to places."""

    def __init__(self, walk: WalkGuard, walk_to: WalkTo) -> None:
        self._walk = walk
        self._walk_to = walk_to
        self.stream: Final = shared.action_stream(walk_to.state, self.getWalkStatePublisher)

    def walkTo(self, x: float, y: float, heading: float, current: Current) -> None:
        shared.require_within(-_FARTHEST_PLACE, _FARTHEST_PLACE, x=x, y=y)
        shared.require_within(-math.tau, math.tau, heading=heading)
        with shared.refusals_raised():
            way = way_to((x, y, heading), self._walk.read(), self._walk.limits, self._walk.lag)
            self._walk_to.begin(way, current.client)

    def stop(self, current: Current) -> None:
        self._walk_to.stop()

    def getWalkState(self, current: Current) -> ActionState:
        return self._walk_to.state()


class EncodersI(Encoders):
    """Report where the robot believes it is, in calls and as a stream."""

    def __init__(self, walk: WalkGuard) -> None:
        self.stream: Final = shared.StateStream(walk.read, self.getEncodersDataPublisher, _data)

    def getEncodersData(self, current: Current) -> EncodersData:
        return self.stream.now()


def _data(odometry: Odometry) -> EncodersData:
    return EncodersData(
        robotx=odometry.x,
        roboty=odometry.y,
        robottheta=odometry.heading,
        robotcos=math.cos(odometry.heading),
        robotsin=math.sin(odometry.heading),
    )


_HIGHEST_SPEED: Final = 2.0
MOTION: Final = "motion"
"""The player's kind for actions of `Motions`."""
POSTURE: Final = "posture"
"""The player's kind for actions of `Postures`."""
_WAY: Final = sentence("the way into a posture")
"""The claim on the joints while a robot goes its own way."""
_PERIOD: Final = 0.05
"""Wall seconds between two checks whether such a way has ended."""


class MotionsI(Motions):
    """Play motions, and report their progress."""

    def __init__(self, player: MotionPlayer) -> None:
        self._player = player
        self.stream: Final = shared.action_stream(
            lambda: player.progress(MOTION), self.getMotionStatePublisher
        )

    def getMotions(self, current: Current) -> list[MotionFacts]:
        motions = self._player.motions.values()
        return [MotionFacts(of.name, of.description, of.duration, of.start) for of in motions]

    def play(self, name: str, pace: float, current: Current) -> None:
        motions = self._player.motions
        shared.require_known(sentence("motion"), name, motions)
        shared.require_positive(_HIGHEST_SPEED, pace=pace)
        route = MotionRoute(self._player.body, motions[name], motions.values())
        with shared.refusals_raised():
            self._player.begin(MOTION, name, route, pace=pace, client=current.client)

    def stop(self, current: Current) -> None:
        self._player.stop(MOTION)

    def getMotionState(self, current: Current) -> ActionState:
        return self._player.progress(MOTION)


class PosturesI(Postures):
    """Common part of both kinds of postures."""

    def __init__(self) -> None:
        self.stream: Final = shared.action_stream(self.progress, self.getPostureStatePublisher)

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """The postures that the body can be brought into."""

    @abstractmethod
    def progress(self) -> ActionState:
        """Return the progress of the way to the newest posture."""

    @abstractmethod
    def go(self, name: str, fraction: float, client: str) -> None:
        """Begin to go to a posture. Raises InvalidCommand or CommandRefused."""

    @abstractmethod
    def halt(self) -> None:
        """Stop on the way to a posture."""

    @abstractmethod
    def posture(self) -> str:
        """Return the posture that the body is in; empty when it is in none."""

    def getPostures(self, current: Current) -> list[str]:
        return list(self.names)

    def goToPosture(self, name: str, fraction: float, current: Current) -> None:
        shared.require_known(sentence("posture"), name, self.names)
        shared.require_positive(1.0, fraction=fraction)
        with shared.refusals_raised():
            self.go(name, fraction, current.client)

    def stop(self, current: Current) -> None:
        self.halt()

    def getPosture(self, current: Current) -> str:
        return self.posture()

    def getPostureState(self, current: Current) -> ActionState:
        return self.progress()


class KeyFramePosturesI(PosturesI):
    """Bring a body into postures by the server's own motions."""

    def __init__(self, player: MotionPlayer) -> None:
        super().__init__()
        self._player = player

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._player.body.postures)

    def progress(self) -> ActionState:
        return self._player.progress(POSTURE)

    def go(self, name: str, fraction: float, client: str) -> None:
        """Begin to go to a posture, getting up on the way if the body lies."""
        route = PostureRoute(self._player.body, name, self._player.motions.values(), fraction)
        self._player.begin(POSTURE, name, route, client=client)

    def halt(self) -> None:
        self._player.stop(POSTURE)

    def posture(self) -> str:
        return nearest_posture(self._player.body, self._player.situation())


class OwnPosturesI(PosturesI):
    """Pass postures on to a robot that knows the way itself, through the gate of its `body`.

    On the way it claims all joints: stopping one of them ends the way. `watch` must be called
    regularly, so that the joints are freed at its end.
    """

    def __init__(self, postures: OwnPostures, body: GuardedDevice) -> None:
        super().__init__()
        self.name: Final = "postures"
        self._postures = postures
        self._body = body
        self._lock = threading.Lock()
        self._closed = False
        self._count = 0
        self._client = ""

    @property
    def names(self) -> tuple[str, ...]:
        return self._postures.names

    def progress(self) -> ActionState:
        of = self._poll()
        if of.moving:
            status = ActionStatus.Moving
        elif of.reached:
            status = ActionStatus.Done
        else:
            status = ActionStatus.Failed if of.message else ActionStatus.Idle
        time = self._body.events.robot_time()
        return ActionState(time, of.name, status, float(of.reached), of.message, self._count)

    def go(self, name: str, fraction: float, client: str) -> None:
        joints = [joint.name for joint in self._body.joints]
        with self._lock:
            self._body.gate.require(client)
            if self._closed:
                return
            self._body.claims.claim(_WAY, joints, self.halt)
            try:
                self._postures.go(name, fraction)
            except BaseException:
                self._body.claims.release(_WAY)
                raise
            self._count += 1
            self._client = client
        self._body.check_within(_PERIOD)
        try:
            self._body.gate.require(client)
        except CommandRefused:  # an emergency stop came in between
            self.halt()
            raise

    def halt(self) -> None:
        """Stop on the way, and free the joints: they need nothing more to come to rest."""
        self._postures.stop()
        self._body.claims.release(_WAY)

    def posture(self) -> str:
        return self._postures.current()

    def watch(self) -> float | None:
        """Free the joints at the end of the way; return the wall seconds until the next check."""
        return _PERIOD if self._poll().moving else None

    def moves_for(self, client: str) -> bool:
        """Return whether it is on a way that a client commanded."""
        return self._client == client and self._poll().moving

    def drop_client(self, client: str) -> None:
        """Do nothing: the robot's own way runs to its end, because half way the body may fall."""

    def close(self) -> None:
        """Stop on the way, and refuse further ones."""
        with self._lock:
            self._closed = True
        self.halt()

    def _poll(self) -> PostureProgress:
        with self._lock:
            progress = self._postures.progress()
            if not progress.moving:
                self._body.claims.release(_WAY)
        return progress
