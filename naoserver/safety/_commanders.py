"""The clients that command, and those that a stop ended: a reset starts nothing (ISO 13850:2015, 4.1.4)."""

from __future__ import annotations

from typing import Final

_MOST: Final = 1024
"""Clients that are known, those that commanded last: strangers may make up any number of names."""


class Commanders:
    """Know the clients that command, and which of them a person has to let go on. Not thread-safe.

    A stop ends the commands of all that commanded before it or do beside it. The loop of such a client may
    not know of the stop, and no silence shows that it has ended: it may sleep, wait for something else, or be
    held, also for longer than its link lasts. A client that is new after the stop was started by a person.
    """

    def __init__(self) -> None:
        self._ended: dict[str, bool] = {}  # whether a stop ended its commands; who commanded last is last

    def note(self, client: str, *, stopped: bool) -> bool:
        """Note a command; return whether a stop ended the commands of its client, now or before."""
        ended = self._ended.pop(client, False) or stopped
        self._ended[client] = ended
        if len(self._ended) > _MOST:
            del self._ended[next(iter(self._ended))]
        return ended

    def stop(self) -> None:
        """End the commands of all."""
        self._ended = dict.fromkeys(self._ended, True)

    def let_go_on(self, client: str | None = None) -> None:
        """Let one client command again, or all: a person lets them go on."""
        if client is None:
            self._ended.clear()
        else:
            self._ended.pop(client, None)
