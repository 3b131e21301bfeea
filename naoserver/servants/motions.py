"""Servant of the motions made of key frames."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from interfaces.jderobot import InvalidValueException
from interfaces.nao import ActionState, MotionFacts, Motions
from naoserver.motions.keyframes import Motion
from naoserver.motions.player import ActionProgress, MotionPlayer
from naoserver.motions.routes import MotionRoute, RouteError
from naoserver.servants.conversions import refusals_told, require_finite
from naoserver.servants.streaming import Changes
from zenoh_ice import Current

_FASTEST: Final = 2.0
KIND: Final = "motion"
"""What the player calls an action of this servant."""


class MotionsI(Motions):
    """Play motions, and tell how they go. `robot_time` is in s."""

    def __init__(
        self, player: MotionPlayer, motions: Mapping[str, Motion], robot_time: Callable[[], float]
    ) -> None:
        self._player = player
        self._motions = motions
        self._robot_time = robot_time
        self._changes = Changes()

    def getMotions(self, current: Current) -> list[MotionFacts]:  # noqa: ARG002
        """Return the motions that can be played."""
        return [
            MotionFacts(name=of.name, description=of.description, duration=of.duration, start=of.start)
            for of in self._motions.values()
        ]

    def play(self, name: str, pace: float, current: Current) -> None:
        """Begin a motion at a pace; the action before ends.

        Raises InvalidValueException, also when it cannot begin as the body is, or CommandRefusedException.
        """
        motion = self._motions.get(name)
        if motion is None:
            message = f"there is no motion {name[:64]!r}; there are {', '.join(self._motions)}"
            raise InvalidValueException(message, "name")
        require_finite(pace=pace)
        if not 0.0 < pace <= _FASTEST:
            raise InvalidValueException(
                f"pace is {pace:g}: it must be above 0 and at most {_FASTEST:g}", "pace"
            )
        route = MotionRoute(motion, self._motions.values())
        with refusals_told():
            try:
                self._player.begin(KIND, name, route, pace=pace, client=current.client)
            except RouteError as error:
                raise InvalidValueException(str(error), "name") from error

    def stop(self, current: Current) -> None:  # noqa: ARG002
        """Stop what is played, and hold its joints where they are."""
        self._player.stop(KIND)

    def getMotionState(self, current: Current) -> ActionState:  # noqa: ARG002
        """Return how the newest motion goes."""
        return self.read()

    @property
    def device(self) -> MotionsI:
        """Itself: nobody else tells of the motions."""
        return self

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getMotionStatePublisher.listening

    def read(self) -> ActionState:
        """Return how the newest motion goes."""
        return action_state(self._player.progress(KIND), self._robot_time())

    def publish(self, state: ActionState) -> None:
        """Send how the newest motion goes to whoever listens, when it is news."""
        if self._changes.are_news((state.count, state.status, state.progress), state.time):
            self.getMotionStatePublisher.publish(state, time=state.time)


def action_state(progress: ActionProgress, time: float) -> ActionState:
    """Return how an action goes as the interface has it."""
    return ActionState(
        time=time,
        name=progress.name,
        status=progress.status,
        progress=progress.progress,
        message=progress.message,
        count=progress.count,
    )
