"""The warning that nothing of ROS answers, once that has lasted for a while."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from typing import Final

from ._limits import LIMITS

_CHECK_PERIOD: Final = 0.1  # s
_END_LIMIT: Final = 2.0  # s

_logger = logging.getLogger(__name__)


class AbsenceWarning:
    """Waits on a thread for the first link of a node, and warns if there is none within some seconds."""

    def __init__(
        self, connected: Callable[[], bool], endpoints: Sequence[str], delay: float = LIMITS.first_link
    ) -> None:
        """Wait for `connected` until `close`; the warning names the endpoints."""
        self._connected: Final = connected
        self._delay: Final = delay
        self._where: Final = ", ".join(endpoints)
        self._end: Final = threading.Event()
        self._thread: threading.Thread | None = None
        if connected():
            return
        thread = threading.Thread(target=self._wait, name="first link to ROS", daemon=True)
        try:
            thread.start()
        except RuntimeError:  # at a limit of threads: the warning comes early rather than never
            self._warn()
        else:
            self._thread = thread

    def close(self) -> None:
        """Warn no more."""
        self._end.set()
        if self._thread is not None:
            self._thread.join(_END_LIMIT)

    def _wait(self) -> None:
        for _ in range(round(self._delay / _CHECK_PERIOD)):
            if self._end.wait(_CHECK_PERIOD) or self._connected():
                return
        self._warn()

    def _warn(self) -> None:
        _logger.warning("nothing of ROS answers at %s so far: start rmw_zenohd or `nao router`", self._where)
