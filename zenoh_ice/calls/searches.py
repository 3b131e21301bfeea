"""Calls of servants that have to be found first: they wait in line, and hold up those of no other servant."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

from ..dispatch import Dispatcher, Lane
from ..exceptions import BusyException
from ..identity import Target

__all__ = ["Searches"]

_MOST_WAITING: Final = 1024  # calls in one line
_MOST_LINES: Final = 256  # each has a thread that waits

_Key = tuple[Target, float]


class Searches:
    """Run what finds a servant and then calls it, in lines: one for each servant and limit of calls.

    So calls are made in the order in which they were asked for, and none waits for one that may take longer.
    """

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher: Final = dispatcher
        self._lock: Final = threading.Lock()
        self._lines: Final[dict[_Key, tuple[Lane, int]]] = {}
        """With how many calls are in each, as long as there are any."""

    def under_way(self, target: Target, limit: float) -> bool:
        """Return whether calls wait for a servant to be found: later ones must not overtake them."""
        return bool(self._lines) and (target, limit) in self._lines

    def submit(self, target: Target, limit: float, find_and_call: Callable[[], object]) -> None:
        """Run a function after those before it; raises BusyException when too many wait."""
        key = target, limit

        def run() -> None:
            try:
                with self._dispatcher.blocked():
                    find_and_call()
            finally:
                self._count(key, -1)

        lane = self._count(key, 1)
        try:
            lane.submit(run)
        except BaseException:
            self._count(key, -1)
            raise

    def _count(self, key: _Key, change: int) -> Lane:
        with self._lock:
            lane, count = self._lines.get(key) or (self._new_lane(*key), 0)
            if count + change:
                self._lines[key] = lane, count + change
            else:
                del self._lines[key]
        return lane

    def _new_lane(self, target: Target, _: float) -> Lane:
        if len(self._lines) >= _MOST_LINES:
            raise BusyException(
                f"{target}: {_MOST_LINES} servants are looked for already; this call was not executed"
            )
        return Lane(self._dispatcher, f"looking for {target}", depth=_MOST_WAITING)
