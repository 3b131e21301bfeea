"""Servant of the lights."""

from __future__ import annotations

from collections.abc import Callable

from interfaces.jderobot import InvalidValueException
from interfaces.nao import LedColor, Leds, LedState
from naoserver.capabilities import Lights
from naoserver.servants.conversions import refusals_told, require_finite
from naoserver.servants.streaming import Changes
from zenoh_ice import Current

_LONGEST_FADE = 60.0  # s
_LONGEST_NAME = 64  # characters of a client's text that are told back


class LedsI(Leds):
    """Set the lights, and tell what they show. `robot_time` is in s."""

    def __init__(self, lights: Lights, robot_time: Callable[[], float]) -> None:
        self._lights = lights
        self._robot_time = robot_time
        self._changes = Changes()

    def getLedNames(self, current: Current) -> list[str]:  # noqa: ARG002
        """Return the names of the groups."""
        return list(self._lights.names)

    def setLed(self, name: str, color: LedColor, seconds: float, current: Current) -> None:  # noqa: ARG002
        """Let a group fade to a color in some seconds.

        Raises InvalidValueException, and then changes nothing.
        """
        if name not in self._lights.names:
            known = ", ".join(self._lights.names)
            raise InvalidValueException(
                f"there is no light {name[:_LONGEST_NAME]!r}; there are {known}", "name"
            )
        parts = {"red": color.red, "green": color.green, "blue": color.blue}
        require_finite(**parts, seconds=seconds)
        for part, value in parts.items():
            if not 0.0 <= value <= 1.0:
                raise InvalidValueException(f"{part} is {value:g}: it must be from 0 to 1", part)
        if not 0.0 <= seconds <= _LONGEST_FADE:
            message = f"seconds is {seconds:g}: it must be from 0 to {_LONGEST_FADE:g}"
            raise InvalidValueException(message, "seconds")
        with refusals_told():
            self._lights.set(name, (color.red, color.green, color.blue), seconds)

    def reset(self, current: Current) -> None:  # noqa: ARG002
        """Turn every light to what it shows after the start."""
        self._lights.reset()

    def getLeds(self, current: Current) -> LedState:  # noqa: ARG002
        """Return what the lights show."""
        return self.read()

    @property
    def device(self) -> LedsI:
        """Itself: nobody else tells of the lights."""
        return self

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getLedsPublisher.listening

    def read(self) -> LedState:
        """Return what the lights show."""
        colors = {name: LedColor(*color) for name, color in self._lights.colors().items()}
        return LedState(time=self._robot_time(), colors=colors)

    def publish(self, state: LedState) -> None:
        """Send what the lights show to whoever listens, when it is news."""
        if self._changes.are_news(state.colors, state.time):
            self.getLedsPublisher.publish(state, time=state.time)
