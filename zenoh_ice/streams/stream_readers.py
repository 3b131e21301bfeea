"""All streams that a communicator reads: shared by its proxies, and let go of when nobody wants them."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any, Final, TypeVar

import zenoh

from ..identity import Target
from ..operation import Operation
from . import stream_reader
from .stream_reader import StreamReader

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["StreamReaders"]

V = TypeVar("V")

_LOOKS: Final = 4  # for readers that nobody wants, in the time that they linger
_JOIN_LIMIT: Final = 2.0

_logger = logging.getLogger(__name__)


class StreamReaders:
    """Make readers, one for each stream, and look after them on a thread that starts with the first."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator: Final = communicator
        self._lock = threading.Lock()
        self._readers: dict[tuple[Target, Operation[..., Any]], StreamReader[Any]] = {}
        self._closed = threading.Event()
        self._thread = threading.Thread(
            target=self._look_after, name=f"streams of {communicator.client_id}", daemon=True
        )

    def get(self, target: Target, operation: Operation[..., V]) -> StreamReader[V]:
        """Return the reader of a stream."""
        with self._lock:
            reader = self._readers.get((target, operation))
            if reader is None:
                reader = self._readers[target, operation] = StreamReader(
                    self._communicator, target, operation
                )
                if self._thread.ident is None and not self._closed.is_set():
                    self._thread.start()
            return reader

    def close(self) -> None:
        """Close all readers."""
        with self._lock:
            self._closed.set()
            readers = list(self._readers.values())
        for reader in readers:
            self._close(reader)
        if self._thread.ident is not None and self._thread is not threading.current_thread():
            self._thread.join(_JOIN_LIMIT)

    def _close(self, reader: StreamReader[Any]) -> None:
        try:
            reader.close()
        except zenoh.ZError as error:
            _logger.debug("%s: %s", reader.what, error)

    def _look_after(self) -> None:
        while not self._closed.wait(stream_reader.LINGER / _LOOKS):
            with self._lock:
                readers = list(self._readers.values())
            for reader in readers:
                try:
                    reader.let_go_if_unwanted()
                except zenoh.ZError as error:  # the session is closed meanwhile
                    _logger.debug("%s: %s", reader.what, error)
