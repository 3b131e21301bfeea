"""Callbacks on streams."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any, Final, Self, TypeVar

from .dispatch import mark_thread
from .exceptions import CommunicatorDestroyedException, MarshalException
from .stream_reader import Sample, StreamReader

__all__ = ["Subscription"]

V = TypeVar("V")

_JOIN_LIMIT: Final = 2.0  # s for which `close` waits for a callback that runs

_logger = logging.getLogger(__name__)


class Subscription:
    """A callback on a stream; `close` ends it, also as the end of a `with` block."""

    def __init__(
        self,
        reader: StreamReader[V],
        callback: Callable[[Sample[V]], Any],
        ended: Callable[[Subscription], None],
    ) -> None:
        self._reader: Final = reader
        self._ended: Final = ended
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._thread = threading.Thread(
            target=self._run, args=(reader, callback), name=f"subscription {reader.what}", daemon=True
        )
        reader.join()
        self._thread.start()

    def close(self) -> None:
        """End the calls; waits for one that runs, for at most 2 s, unless called from within it."""
        with self._lock:
            first = not self._closed.is_set()
            self._closed.set()
        if first:
            self._reader.wake()
            self._reader.leave()
            self._ended(self)
        if self._thread is not threading.current_thread():
            self._thread.join(_JOIN_LIMIT)
            if self._thread.is_alive():
                _logger.error("the callback on %s still runs", self._reader.what)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self, reader: StreamReader[V], callback: Callable[[Sample[V]], Any]) -> None:
        mark_thread()
        sample: Sample[V] | None = None
        readable = True
        while True:
            try:
                sample = reader.wait_until_stopped(sample, self._closed)
            except CommunicatorDestroyedException:
                return
            except MarshalException as error:
                if readable:
                    _logger.error("%s; the next that fits goes on", error)
                readable = False
                continue
            if sample is None or self._closed.is_set():
                return
            readable = True
            try:
                callback(sample)
            except BaseException:
                _logger.exception("the callback on %s failed", reader.what)
