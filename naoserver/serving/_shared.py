"""Shared by servants: the stream of a state, checks of arguments, and conversion of errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from operator import attrgetter
from typing import Final, Generic, Protocol, TypeVar

from interfaces.jderobot import CommandRefusedException, InvalidValueException, Time
from interfaces.nao import ActionState
from naoserver.errors import CommandRefused, InvalidCommand
from zenoh_ice import Publisher
from zenoh_ice.data.text import sentence

_REMINDER: Final = 0.5
"""Robot seconds after which an unchanged state is sent again."""
MOST_QUOTED: Final = 64
"""Maximum characters of a client's text in an error."""


class Timed(Protocol):
    """A reading of one moment."""

    @property
    def time(self) -> float:
        """Robot time in s."""


R = TypeVar("R", bound=Timed)
V = TypeVar("V")


class StateStream(Generic[R, V]):
    """The stream of a servant: the result of `read`, or a part of it, converted to the interface's type.

    Streams with the same `read` share one reading. With `news`, a reading is sent only when the result of
    `news` for it has changed, or after half a second, for new listeners.
    """

    def __init__(
        self,
        read: Callable[[], R],
        publisher: Publisher[V],
        convert: Callable[[R], V],
        *,
        news: Callable[[R], object] | None = None,
    ) -> None:
        self.read: Final = read
        """Return the newest snapshot without blocking."""
        self._publisher = publisher
        self._convert = convert
        self._news = news
        self._last: object = None
        self._sent = -math.inf

    def now(self) -> V:
        """Return the newest state, as a call of the servant does."""
        return self._convert(self.read())

    @property
    def listening(self) -> bool:
        """Whether anybody listens."""
        return self._publisher.listening

    def send(self) -> None:
        """Send the newest state, if anybody listens."""
        if self.listening:
            self.publish(self.read())

    def publish(self, reading: R) -> None:
        """Send a reading to the listeners."""
        time = reading.time
        if self._news is not None:
            state = self._news(reading)
            if state == self._last and 0.0 <= time - self._sent < _REMINDER:
                return
            self._last, self._sent = state, time
        self._publisher.publish(self._convert(reading), time=time)


def stream_of(read: Callable[[], R], publisher: Publisher[R], *news: str) -> StateStream[R, R]:
    """Return the stream of a state of the interface's type; with `news`, it sends changes of these fields."""
    return StateStream(read, publisher, lambda state: state, news=attrgetter(*news) if news else None)


def action_stream(
    read: Callable[[], ActionState], publisher: Publisher[ActionState]
) -> StateStream[ActionState, ActionState]:
    """Return the stream of an action, which sends every change of it."""
    return stream_of(read, publisher, "count", "status", "progress")


def to_time(seconds: float) -> Time:
    """Return a point in robot time as the interface's type."""
    whole, micro = divmod(round(seconds * 1_000_000), 1_000_000)
    return Time(seconds=whole, useconds=micro)


def require_finite(**values: float) -> None:
    """Raise InvalidValueException, naming the field, unless every value is a finite number."""
    for field, value in values.items():
        if not math.isfinite(value):
            raise InvalidValueException(f"{field} is {value}: it must be a finite number", field)


def require_positive(upper: float, **values: float) -> None:
    """Raise InvalidValueException, naming the field, unless every value is above 0 and at most `upper`."""
    for field, value in values.items():
        if not 0.0 < value <= upper:
            message = sentence(f"{field} is {value:g}: it must be above 0 and at most {upper:g}")
            raise InvalidValueException(message, field)


def require_known(what: str, name: str, known: Iterable[str]) -> None:
    """Raise InvalidValueException, listing the known names of a kind, unless `name` is one of them."""
    if name not in (names := list(known)):
        known = ", ".join(names)
        message = sentence(f"there is no {what} {name[:MOST_QUOTED]!r}; there are {known}")
        raise InvalidValueException(message, "name")


def require_within(lower: float, upper: float, **values: float) -> None:
    """Raise InvalidValueException, naming the field, unless every value is within limits."""
    for field, value in values.items():
        if not lower <= value <= upper:
            message = sentence(f"{field} is {value:g}: it must be from {lower:g} to {upper:g}")
            raise InvalidValueException(message, field)


@contextmanager
def refusals_raised() -> Iterator[None]:
    """Raise InvalidValueException for InvalidCommand, CommandRefusedException for CommandRefused."""
    try:
        yield
    except InvalidCommand as refusal:
        raise InvalidValueException(str(refusal), refusal.field) from refusal
    except CommandRefused as refusal:
        raise CommandRefusedException(str(refusal), refusal.holder) from refusal
