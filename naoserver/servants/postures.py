"""Servants of the postures: of a body that key frames move, and of a robot that knows the way itself."""

from __future__ import annotations

import threading
from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Final

from interfaces.jderobot import InvalidValueException
from interfaces.nao import ActionState, ActionStatus, Postures
from naoserver.capabilities import OwnPostures, PostureProgress
from naoserver.errors import CommandRefused, RobotError
from naoserver.guarded_device import GuardedDevice
from naoserver.motions.keyframes import Motion
from naoserver.motions.player import ActionProgress, MotionPlayer
from naoserver.motions.postures import POSTURES, nearest_posture
from naoserver.motions.routes import PostureRoute, RouteError
from naoserver.servants.conversions import refusals_told, require_finite, require_fraction
from naoserver.servants.motions import action_state
from naoserver.servants.streaming import Changes
from zenoh_ice import Current

KIND: Final = "posture"
"""What the player calls an action of this servant."""
_OWNER: Final = "the way into a posture"
"""To whom the joints belong while a robot goes its own way."""
_PERIOD: Final = 0.05
"""Wall seconds between two looks whether such a way is at its end."""


class PosturesI(Postures):
    """What both kinds have in common. `robot_time` is in s."""

    def __init__(self, robot_time: Callable[[], float]) -> None:
        self._robot_time = robot_time
        self._changes = Changes()

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """The postures that the body can be brought into."""

    @abstractmethod
    def progress(self) -> ActionProgress:
        """Return how the way to the newest posture goes."""

    @abstractmethod
    def go(self, name: str, fraction: float, client: str) -> None:
        """Begin to go to a posture. Raises RouteError, InvalidCommand or CommandRefused."""

    def getPostures(self, current: Current) -> list[str]:  # noqa: ARG002
        """Return the postures that the body can be brought into."""
        return list(self.names)

    def goToPosture(self, name: str, fraction: float, current: Current) -> None:
        """Begin to go to a posture at a fraction of the full pace.

        Raises InvalidValueException, also when there is no way, or CommandRefusedException.
        """
        if name not in self.names:
            message = f"there is no posture {name[:64]!r}; there are {', '.join(self.names)}"
            raise InvalidValueException(message, "name")
        require_finite(fraction=fraction)
        require_fraction(fraction)
        with refusals_told():
            try:
                self.go(name, fraction, current.client)
            except RouteError as error:
                raise InvalidValueException(str(error), "name") from error

    def getPostureState(self, current: Current) -> ActionState:  # noqa: ARG002
        """Return how the way to the newest posture goes."""
        return self.read()

    @property
    def device(self) -> PosturesI:
        """Itself: nobody else tells of the postures."""
        return self

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getPostureStatePublisher.listening

    def read(self) -> ActionState:
        """Return how the way to the newest posture goes."""
        return action_state(self.progress(), self._robot_time())

    def publish(self, state: ActionState) -> None:
        """Send how the way goes to whoever listens, when it is news."""
        if self._changes.are_news((state.count, state.status, state.progress), state.time):
            self.getPostureStatePublisher.publish(state, time=state.time)


class KeyFramePosturesI(PosturesI):
    """Bring a body into postures by the server's own motions."""

    def __init__(
        self, player: MotionPlayer, motions: Mapping[str, Motion], robot_time: Callable[[], float]
    ) -> None:
        super().__init__(robot_time)
        self._player = player
        self._motions = motions

    @property
    def names(self) -> tuple[str, ...]:
        """The postures whose angles are known."""
        return tuple(POSTURES)

    def progress(self) -> ActionProgress:
        """Return how the way to the newest posture goes."""
        return self._player.progress(KIND)

    def go(self, name: str, fraction: float, client: str) -> None:
        """Begin to go to a posture, getting up on the way where the body lies."""
        self._player.begin(
            KIND, name, PostureRoute(name, self._motions.values(), fraction), client=client
        )  # fmt: skip

    def stop(self, current: Current) -> None:  # noqa: ARG002
        """Stop on the way, and hold every joint where it is."""
        self._player.stop(KIND)

    def getPosture(self, current: Current) -> str:  # noqa: ARG002
        """Return the posture that the body is in; empty when it is in none."""
        return nearest_posture(self._player.situation())


class OwnPosturesI(PosturesI):
    """Pass postures on to a robot that knows the way itself, through the gate in front of its `body`.

    On the way all joints belong to it: who stops one of them ends it. It is to be watched, so that they are
    free at its end; `look_within` is told in how many wall seconds `watch` is due.
    """

    def __init__(
        self,
        postures: OwnPostures,
        body: GuardedDevice,
        robot_time: Callable[[], float],
        look_within: Callable[[float], None],
    ) -> None:
        super().__init__(robot_time)
        self.name: Final = "postures"
        self._postures = postures
        self._body = body
        self._look_within = look_within
        self._lock = threading.Lock()
        self._closed = False
        self._count = 0

    @property
    def names(self) -> tuple[str, ...]:
        """The postures that the robot knows."""
        return self._postures.names

    def progress(self) -> ActionProgress:
        """Return how the way to the newest posture goes."""
        of = self._look()
        if of.moving:
            status = ActionStatus.Moving
        elif of.reached:
            status = ActionStatus.Done
        else:
            status = ActionStatus.Failed if of.message else ActionStatus.Idle
        return ActionProgress(of.name, status, float(of.reached), of.message, self._count)

    def go(self, name: str, fraction: float, client: str) -> None:
        """Let the robot begin to go to a posture."""
        joints = [joint.name for joint in self._body.joints]
        with self._lock:
            self._body.require(client)
            if self._closed:
                return
            self._body.claims.claim(_OWNER, joints, self._end)
            try:
                self._postures.go(name, fraction)
            except RobotError:
                self._body.claims.release(_OWNER)
                raise
            self._count += 1
        self._look_within(_PERIOD)
        try:
            self._body.require(client)
        except CommandRefused:  # an emergency stop came in between
            self._end()
            raise

    def stop(self, current: Current) -> None:  # noqa: ARG002
        """Stop on the way."""
        self._end()

    def getPosture(self, current: Current) -> str:  # noqa: ARG002
        """Return the posture that the robot is in; empty when it is in none."""
        return self._postures.current()

    def watch(self) -> float | None:
        """Free the joints at the end of the way; return in how many wall seconds to look again."""
        return _PERIOD if self._look().moving else None

    def drop_client(self, client: str) -> None:
        """Do nothing: the way that a client began goes on to its end, as a position command does."""

    def close(self) -> None:
        """Stop on the way, and refuse further ones."""
        with self._lock:
            self._closed = True
        self._end()

    def _end(self) -> None:
        """Stop on the way, and free the joints: they need nothing more to come to rest."""
        self._postures.stop()
        self._body.claims.release(_OWNER)

    def _look(self) -> PostureProgress:
        with self._lock:
            progress = self._postures.progress()
            if not progress.moving:
                self._body.claims.release(_OWNER)
        return progress
