"""Tell of processes that serve an identity of ours, too: started before either could know of the other."""

from __future__ import annotations

import logging
import threading
import time
from itertools import groupby
from typing import TYPE_CHECKING, Final, NamedTuple

from ..exceptions import ZenohIceError
from ..wire.text import printable

if TYPE_CHECKING:
    from ..communicator import Communicator
    from ..network.servant_table import ServantInfo

__all__ = ["Rivals"]

_ASK_LIMIT: Final = 1.0  # s
# A realm that is flooded with tokens must flood neither the log nor the threads of the communicator.
_MOST_TOLD: Final = 16  # errors at a time
_TOLD_AGAIN: Final = 1.0  # s after which one more is told
_MOST_NAMED: Final = 8  # servants in one of them

_logger = logging.getLogger(__name__)


class _Rival(NamedTuple):
    """Another process that serves what only one should."""

    servant: str
    """Identity and facet as text."""
    server: str
    """Id of its session."""


class Rivals:
    """Log an error for every process that serves identities of ours, and a warning when that has ended."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator: Final = communicator
        self._lock: Final = threading.Lock()
        self._told: set[_Rival] = set()
        self._budget: float = _MOST_TOLD
        self._budget_at = time.monotonic()
        self._watching = False
        self._changed = False
        self._looking = False

    def start(self) -> None:
        """Watch from now on; does nothing when it does already."""
        with self._lock:
            if self._watching:
                return
            self._watching = True
        self._communicator.presence.add_listener(self._look)

    def _look(self) -> None:  # on a thread of the communicator
        with self._lock:
            self._changed = True
            if self._looking:
                return
            self._looking = True
        # One at a time, and others of the pool go on: asking a rival who it is may take a second.
        self._communicator.dispatcher.submit(self._tell_changes)

    def _tell_changes(self) -> None:
        communicator = self._communicator
        try:
            with communicator.dispatcher.blocked():
                while self._take_change() and not communicator.destroyed:
                    present = communicator.presence.servants(communicator.realm)
                    found = set(_rivals(present, communicator.client_id))
                    for server, servants in _by_server(self._told - found):
                        self._told -= {_Rival(servant, server) for servant in servants}
                        _logger.warning(
                            "%s no longer served by session %s beside this process", _named(servants), server
                        )
                    for server, servants in _by_server(found - self._told):
                        if not self._may_tell():
                            break  # the others, if they are still there at the next change
                        self._told |= {_Rival(servant, server) for servant in servants}
                        self._tell(server, servants)
        except BaseException:
            self._looking = False
            raise

    def _take_change(self) -> bool:
        with self._lock:
            self._looking, self._changed = self._changed, False
            return self._looking

    def _may_tell(self) -> bool:
        now = time.monotonic()
        self._budget = min(_MOST_TOLD, self._budget + (now - self._budget_at) / _TOLD_AGAIN)
        self._budget_at = now
        if self._budget < 1.0:
            return False
        self._budget -= 1.0
        return True

    def _tell(self, server: str, servants: list[str]) -> None:
        communicator = self._communicator
        try:
            status = communicator.processStatus(server, timeout=_ASK_LIMIT)
        except ZenohIceError:
            who = "another process"
        else:
            who = f"{printable(status.program)} (process {status.pid} on {printable(status.host)})"
        _logger.error(
            "%s served in realm %s by %s, session %s, too: each call reaches one of both, and their streams "
            "mix; stop one, or give it another --realm",
            _named(servants),
            communicator.realm,
            who,
            server,
        )


def _by_server(rivals: set[_Rival]) -> list[tuple[str, list[str]]]:
    """Return what each server serves beside us."""
    ordered = sorted(rivals, key=lambda rival: (rival.server, rival.servant))
    return [
        (server, [rival.servant for rival in group])
        for server, group in groupby(ordered, key=lambda rival: rival.server)
    ]


def _named(servants: list[str]) -> str:
    """Return some servants with a verb."""
    names = ", ".join(servants[:_MOST_NAMED])
    more = len(servants) - _MOST_NAMED
    if more > 0:
        names += f" and {more} more"
    return f"{names} {'is' if len(servants) == 1 else 'are'}"


def _rivals(servants: list[ServantInfo], own: str) -> list[_Rival]:
    """Return who serves what a session serves, unless both are replicas; the servants are sorted."""
    rivals = []
    for (identity, facet), group in groupby(servants, key=lambda info: (info.identity, info.facet)):
        serving = {info.server: info for info in group}
        ours = serving.pop(own, None)
        if ours is not None:
            name = f"{identity} -f {facet}" if facet else identity
            rivals += [
                _Rival(name, info.server)
                for info in serving.values()
                if not (ours.replicated and info.replicated)
            ]
    return rivals
