"""Write messages to an MCAP file on a separate thread: recording never waits for the disk."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final, NamedTuple

import msgspec
from mcap.writer import CompressionType, Writer

from .messages import FORMAT, MESSAGES, METADATA, WATCHED, Gap, Message, schema_of
from .reader import LARGEST_MESSAGE

_logger = logging.getLogger(__name__)

_CHUNK: Final = 10
"""Checks after which a chunk ends, so that a killed process loses at most a second; before, each ends one."""
_CHUNK_SIZE: Final = 1 << 20
_MOST_BYTES: Final = 128 << 20
_CLOSE_LIMIT: Final = 10.0  # s


@dataclass(frozen=True)
class WriteLimits:
    """Limits of the messages that wait to be written, and the times of writing them."""

    check_period: float = 0.1
    """s between checks of the queue: waking the thread for each message would cost more than writing it."""
    most_waiting: int = 50_000
    """Messages in the queue; more are dropped."""


WRITE_LIMITS: Final = WriteLimits()


class RecordingFailedError(Exception):
    """A recording cannot be written."""


class Entry(NamedTuple):
    """A queued message, or a function that makes it on the writer's thread. `size` estimates its bytes."""

    topic: str
    time: int
    message: Message | Callable[[], Message]
    size: int = 200


class RecordingWriter:
    """An MCAP file that is being written, until it is closed. Raises RecordingFailedError.

    A file that exists is never overwritten: it may be the only record of a run of the robot.
    Messages that arrive faster than they can be written are dropped when too many wait, and a `Gap` takes
    their place. When the file cannot be written any more, the error is logged once and the rest is dropped.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, str],
        attachments: Mapping[str, str],
        start: int,
        limits: WriteLimits = WRITE_LIMITS,
    ) -> None:
        self._path = path
        self._limits = limits
        self._queue: deque[Entry] = deque()
        self._bytes = 0
        self._lost = 0
        self._latest = start
        self.dropped = 0
        """Number of messages lost so far."""
        self.trouble = ""
        """Why the file is incomplete, as a sentence; empty while it is not."""
        self._stopping = threading.Event()
        self._lock = threading.Lock()
        self._channels: dict[tuple[str, type[Message]], int] = {}
        self._schemas: dict[type[Message], int] = {}
        self._names = {message: name for name, message in MESSAGES.items()}
        self._encoder = msgspec.json.Encoder()
        try:
            # An existing path that is not a file, such as a pipe, is written to: that destroys nothing.
            self._file: IO[bytes] = path.open("wb" if path.exists() and not path.is_file() else "xb")
        except FileExistsError:
            raise RecordingFailedError(
                f"the recording {path} exists, and is not overwritten: choose another name, or delete it"
            ) from None
        except OSError as error:
            raise RecordingFailedError(f"the recording {path} cannot be written: {error.strerror}") from error
        try:
            self._writer = Writer(self._file, _CHUNK_SIZE, CompressionType.ZSTD)
            self._writer.start(profile="", library="visualhfsm")
            self._writer.add_metadata(METADATA, {"format": FORMAT, **metadata})
            for name, text in attachments.items():
                data = text.encode("utf-8", "surrogateescape")
                self._writer.add_attachment(start, start, name, "text/plain", data)
            self._file.flush()
        except OSError as error:
            with suppress(OSError):  # it writes what is left
                self._file.close()
            raise RecordingFailedError(f"the recording {path} cannot be written: {error.strerror}") from error
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    @classmethod
    def watching(cls, path: Path, name: str, document: str) -> RecordingWriter:
        """Record a component as a watcher sees it; `document` is the document's text, empty if unknown."""
        start = time.time_ns()
        metadata = {"name": name, "start": str(start), WATCHED: "yes"}
        return cls(path, metadata, {f"document/{name}.xml": document} if document else {}, start)

    def put(self, entry: Entry) -> None:
        """Queue a message, without waiting."""
        with self._lock:
            self._latest = entry.time
            if len(self._queue) >= self._limits.most_waiting or self._bytes + entry.size > _MOST_BYTES:
                self._lost += 1
                return
            if self._lost:
                self._record_gap(entry.time)
            self._queue.append(entry)
            self._bytes += entry.size

    def show(self, topic: str, message: Message, at: float) -> None:
        """Queue a message for viewers, at a wall time in s, unless it is too large to be read."""
        size = len(msgspec.json.encode(message))
        if size < LARGEST_MESSAGE:
            self.put(Entry(topic, round(at * 1e9), message, size))

    @property
    def crowded(self) -> bool:
        """Whether the queue is too long for large messages."""
        return self._bytes > _MOST_BYTES // 2

    def close(self) -> None:
        """Write the waiting messages and close the file; takes at most 10 s."""
        self._stopping.set()
        self._thread.join(_CLOSE_LIMIT)
        if self._thread.is_alive():
            self.trouble = f"the recording {self._path} does not end: the disk is too slow"
            _logger.error("%s", self.trouble)
        elif self.dropped:
            _logger.warning("the recording %s has gaps: %d messages came too fast", self._path, self.dropped)

    def _record_gap(self, time: int) -> None:
        self._queue.append(Entry("/gaps", time, Gap(self._lost)))
        self.dropped += self._lost
        self._lost = 0

    # The thread.

    def _run(self) -> None:
        try:
            last, rounds = False, 0
            while not last:
                last = self._stopping.wait(self._limits.check_period)
                if last and self._lost:
                    self._record_gap(self._latest)
                self._drain()
                rounds += 1
                if rounds < _CHUNK or rounds % _CHUNK == 0:
                    self._writer.flush()  # type: ignore[no-untyped-call]
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()
        except OSError as error:
            self.trouble = f"the recording {self._path} is incomplete: {error.strerror}"
            _logger.error("%s", self.trouble)
        except Exception:
            self.trouble = f"the recording {self._path} is incomplete"
            _logger.exception("%s", self.trouble)
        finally:
            with suppress(OSError):
                self._file.close()
        while not self._stopping.wait(1.0):  # the file cannot be written: drop what arrives
            self._queue.clear()

    def _drain(self) -> None:
        with self._lock:
            entries = self._queue
            self._queue = deque()
            self._bytes = 0
        for entry in entries:
            try:
                message = entry.message if isinstance(entry.message, Message) else entry.message()
                data = self._encoder.encode(message)
            except Exception:  # a value of user code may be anything: lose the message, not the file
                _logger.exception("a message of %s could not be recorded", entry.topic)
                message = Gap(1)
                data = self._encoder.encode(message)
            topic = "/gaps" if isinstance(message, Gap) else entry.topic
            self._writer.add_message(self._channel(topic, type(message)), entry.time, data, entry.time)

    def _channel(self, topic: str, message: type[Message]) -> int:
        channel = self._channels.get((topic, message))
        if channel is None:
            if message not in self._schemas:
                name = self._names[message]
                self._schemas[message] = self._writer.register_schema(name, "jsonschema", schema_of(message))
            channel = self._writer.register_channel(topic, "json", self._schemas[message])
            self._channels[topic, message] = channel
        return channel
