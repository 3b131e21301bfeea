"""Wait for a server that starts after a command which needs it."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import Final, TypeVar

from zenoh_ice.data.exceptions import ConnectFailedException, ObjectNotExistException, SystemException

_PERIOD: Final = 0.05  # s between two tries
_T = TypeVar("_T")

_logger = logging.getLogger(__name__)


class Patience:
    """Wait for the servers that a command needs, for at most `seconds` of wall time in all."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._end = time.monotonic() + seconds
        self._reported = False

    def until_served(self, connect: Callable[[], _T], is_complete: Callable[[], bool] = lambda: False) -> _T:
        """Return what `connect` returns, which is tried again while there is no server or no such servant.

        What a server that `is_complete` lacks is not waited for. The log says once what is waited for. Raises
        the last reason when the time is over, and all other exceptions of `connect`.
        """
        while True:
            complete = is_complete()
            try:
                return connect()
            except (ConnectFailedException, ObjectNotExistException) as error:
                if complete or time.monotonic() >= self._end:
                    raise
                self._report(error)
            time.sleep(_PERIOD)

    def _report(self, why: SystemException) -> None:
        if not self._reported:
            self._reported = True
            _logger.warning("waiting for the server (--server-wait %g): %s", self._seconds, why)
