"""All streams that a communicator reads: shared by its proxies, and let go of when nobody wants them."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any, Final, TypeVar
from weakref import WeakValueDictionary

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
    """Make readers, one for each stream, and look after them on a thread that starts with the first.

    A reader is kept as long as it listens or somebody has it.
    """

    def __init__(self, communicator: Communicator) -> None:
        self._communicator: Final = communicator
        self._lock = threading.Lock()
        self._readers: WeakValueDictionary[tuple[Target, Operation[..., Any]], StreamReader[Any]] = (
            WeakValueDictionary()
        )
        self._listening: Final[set[StreamReader[Any]]] = set()
        self._closed = threading.Event()
        self._thread = threading.Thread(
            target=self._look_after, name=f"streams of {communicator.client_id}", daemon=True
        )
        communicator.presence.add_listener(self._wake)

    def get(self, target: Target, operation: Operation[..., V]) -> StreamReader[V]:
        """Return the reader of a stream."""
        with self._lock:
            reader = self._readers.get((target, operation))
            if reader is None:
                reader = StreamReader(self._communicator, target, operation, self._listening)
                self._readers[target, operation] = reader
                if self._thread.ident is None and not self._closed.is_set():
                    self._thread.start()
            return reader

    def close(self) -> None:
        """Close all readers."""
        with self._lock:
            self._closed.set()
        for reader in self._all():
            self._close(reader)
        if self._thread.ident is not None and self._thread is not threading.current_thread():
            self._thread.join(_JOIN_LIMIT)

    def _close(self, reader: StreamReader[Any]) -> None:
        try:
            reader.close()
        except zenoh.ZError as error:
            _logger.debug("%s: %s", reader.what, error)

    def _all(self) -> list[StreamReader[Any]]:
        with self._lock:
            return list(self._readers.values())

    def _wake(self) -> None:
        for reader in self._all():
            reader.wake()

    def _look_after(self) -> None:
        while not self._closed.wait(stream_reader.LINGER / _LOOKS):
            for reader in tuple(self._listening):
                try:
                    reader.let_go_if_unwanted()
                except zenoh.ZError as error:  # the session is closed meanwhile
                    _logger.debug("%s: %s", reader.what, error)
                del reader  # not kept by who looks after it
