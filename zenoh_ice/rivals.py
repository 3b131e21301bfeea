"""Tell of processes that serve an identity of ours, too: started before either could know of the other."""

from __future__ import annotations

import logging
import threading
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Final, NamedTuple

from .exceptions import ZenohIceError
from .text import printable

if TYPE_CHECKING:
    from .communicator import Communicator
    from .presence import ServantInfo

__all__ = ["Rivals"]

_ASK_LIMIT: Final = 1.0  # s
_MOST_TOLD: Final = 256  # a realm that is flooded with tokens must not flood the log

_logger = logging.getLogger(__name__)


class _Rival(NamedTuple):
    """Another process that serves what only one should."""

    servant: str
    """Identity and facet as text."""
    server: str
    """Id of its session."""


class Rivals:
    """Log an error for every process that serves an identity of ours, and a warning when that has ended."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator: Final = communicator
        self._lock: Final = threading.Lock()
        self._known: frozenset[_Rival] = frozenset()
        self._watching = False

    def start(self) -> None:
        """Watch from now on; does nothing when it does already."""
        with self._lock:
            if self._watching:
                return
            self._watching = True
        self._communicator.presence.add_listener(self._look)

    def _look(self) -> None:  # on a thread of the communicator
        communicator = self._communicator
        if communicator.destroyed:
            return
        servants = communicator.presence.servants(communicator.realm)
        found = frozenset(_rivals(servants, communicator.client_id))
        with self._lock:
            known, self._known = self._known, found
        for rival in sorted(found - known)[:_MOST_TOLD]:
            communicator.dispatcher.submit(partial(self._tell, rival))
        for rival in sorted(known - found)[:_MOST_TOLD]:
            _logger.warning("%s is no longer served by session %s beside this process", *rival)

    def _tell(self, rival: _Rival) -> None:
        communicator = self._communicator
        try:
            with communicator.dispatcher.blocked():
                status = communicator.processStatus(rival.server, timeout=_ASK_LIMIT)
        except ZenohIceError:
            who = "another process"
        else:
            who = f"{printable(status.program)} (process {status.pid} on {printable(status.host)})"
        _logger.error(
            "%s of realm %s is served by %s, session %s, too: each call reaches one of both, and their "
            "streams mix; stop one, or give it another --realm",
            rival.servant,
            communicator.realm,
            who,
            rival.server,
        )


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
