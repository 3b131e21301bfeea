"""Events on their way: checked when they are sent, and kept for each automaton until its next cycle."""

from __future__ import annotations

import math
from collections import deque
from typing import Any, Final

from .automaton import Event
from .errors import EventError

__all__ = ["CAPACITY", "Inbox", "make_event"]

CAPACITY: Final = 64
"""How many events an automaton keeps; of more the oldest are lost."""

_DEEPEST: Final = 32
_NONE: Final[dict[str, Event]] = {}


class Inbox:
    """The events that arrived at one automaton since its last cycle began."""

    __slots__ = ("_events",)

    def __init__(self) -> None:
        self._events: deque[Event] = deque()

    def put(self, event: Event) -> Event | None:
        """Keep an event; return the one that is lost for it, if any."""
        lost = self._events.popleft() if len(self._events) >= CAPACITY else None
        self._events.append(event)
        return lost

    def take(self) -> dict[str, Event]:
        """Return the newest event of each name, and keep none."""
        if not self._events:
            return _NONE
        newest = {event.name: event for event in self._events}
        self._events.clear()
        return newest

    def clear(self) -> None:
        """Forget all events."""
        self._events.clear()


def make_event(name: str, data: object = None) -> Event:
    """Return an event with a copy of its data; raises EventError when JSON cannot tell the data."""
    if not isinstance(name, str) or not name:
        raise EventError(f"an event has a name, which is text, not {name!r}")
    return Event(name, _copy(data, f"the data of the event {name!r}", 0))


def _copy(value: object, where: str, depth: int) -> Any:  # noqa: ANN401 - whatever JSON knows
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        if math.isfinite(value):
            return value
        raise EventError(f"{where} is {value}, which JSON cannot tell")
    if depth >= _DEEPEST:
        raise EventError(f"{where} is nested deeper than {_DEEPEST} levels")
    if isinstance(value, list | tuple):
        return [_copy(item, f"{where}[{index}]", depth + 1) for index, item in enumerate(value)]
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str):
                raise EventError(f"{where} has the key {key!r}: keys are text")
        return {key: _copy(item, f"{where}[{key!r}]", depth + 1) for key, item in value.items()}
    raise EventError(
        f"{where} is a {type(value).__name__}: it may be None, bool, int, float, str, lists, "
        "and dicts with text as keys"
    )
