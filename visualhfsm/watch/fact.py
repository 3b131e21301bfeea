"""A value that is asked for by a call until it is there, without ever making the caller wait."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Final, Generic, TypeVar

from zenoh_ice import ZenohIceError

__all__ = ["Fact"]

T = TypeVar("T")

_PAUSE: Final = 0.5
"""Seconds between two attempts."""

_logger = logging.getLogger(__name__)


class Fact(Generic[T]):
    """The answer to a call; `poll` it regularly."""

    def __init__(self, ask: Callable[[], Future[T]]) -> None:
        self.value: T | None = None
        self.trouble = ""
        self._ask = ask
        self._pending: Future[T] | None = None
        self._next = 0.0

    def forget(self) -> None:
        """Ask anew: what answered has changed."""
        self.value = None
        self._pending = None

    def poll(self) -> T | None:
        """Ask if it is time to, take the answer if it is there, and return what is known."""
        if self._pending is not None and self._pending.done():
            pending, self._pending = self._pending, None
            try:
                self.value = pending.result()
                self.trouble = ""
            except ZenohIceError as error:
                _logger.debug("no answer yet: %s", error)
                self.trouble = str(error)
        if self.value is None and self._pending is None and time.monotonic() >= self._next:
            self._next = time.monotonic() + _PAUSE
            self._pending = self._ask()
        return self.value
