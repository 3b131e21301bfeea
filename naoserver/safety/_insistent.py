"""The clients that went on commanding a stopped robot: a reset starts nothing (ISO 13850:2015, 4.1.4)."""

from __future__ import annotations

from typing import Final

from zenoh_ice.data.text import few, printable

SILENCE: Final = 1.0
"""Wall seconds after which the next command of a client is a new one."""
_MOST: Final = 1024
"""Clients that are distinguished; further ones count as one."""
_LONGEST_NAME: Final = 64


class Insistent:
    """Distinguish clients that command on from others. Not thread-safe.

    A client that commanded a stopped robot insists until it was silent for SILENCE: its loop may not know of
    the stop. Memory is bounded, however many names strangers make up.
    """

    def __init__(self) -> None:
        # When each commanded last, in steady wall time, the earliest first; None stands for all beyond MOST.
        self._newest: dict[str | None, float] = {}

    def names(self) -> str:
        """Return the clients that insist, as an event names them."""
        return few([printable(each or "", _LONGEST_NAME) or "others" for each in self._newest])

    def insists(self, client: str, now: float, *, stopped: bool) -> bool:
        """Note a command; return whether its client commanded the stopped robot, without a silence since."""
        while self._newest and now - next(iter(self._newest.values())) >= SILENCE:
            del self._newest[next(iter(self._newest))]
        known = client in self._newest
        if not (stopped or known or None in self._newest):
            return False
        name = client if known or len(self._newest) < _MOST else None
        self._newest.pop(name, None)
        self._newest[name] = now
        return True

    def let_go_on(self) -> None:
        """Forget all: a person lets them go on."""
        self._newest.clear()
