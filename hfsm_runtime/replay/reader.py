"""Read a recording, also one that was cut off; what it holds is checked, and nothing in it is executed."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Final, NamedTuple, Self

import msgspec

from ..recording.messages import MESSAGES, METADATA, Gap, Image, Message
from .errors import RecordingError

__all__ = ["Record", "Recording"]

_LARGEST_RECORD: Final = 256 << 20
_LARGEST_CHUNK: Final = 256 << 20
_MOST_RECORDS: Final = 50_000_000
_MOST_BYTES: Final = 4 << 30
"""Bytes of messages that are kept in memory, whatever they take in the file."""
_BROKEN: Final = (ValueError, EOFError, struct.error, KeyError, IndexError, UnicodeDecodeError, OverflowError)
# A file that was cut off ends in the middle of a record, which the library's parser meets unprepared.


class Record(NamedTuple):
    """A message, and its time in ns since the start of the component."""

    time: int
    topic: str
    message: Message
    data: bytes
    """The message as it stands in the file."""


class Recording:
    """A recording as a whole, except for its images, which wait in a temporary file.

    It is read when it is made: raises RecordingError. `truncated` tells whether it ends in the middle, as
    that of a process that was killed does. Close it, or use it in a `with` block.
    """

    def __init__(self, path: Path) -> None:
        self.metadata: dict[str, str] = {}
        self.attachments: dict[str, str] = {}
        """The sources, by names such as `document/follow_ball.xml`."""
        self.truncated = False
        self.lost = 0
        """Messages that are missing in gaps."""
        self._records: list[tuple[int, int, bytes]] = []
        self._size = 0
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, type[Message]]] = {}
        self._decoders = {message: msgspec.json.Decoder(message) for message in MESSAGES.values()}
        self._images: dict[str, tuple[int, int]] = {}
        self._spool: IO[bytes] = tempfile.TemporaryFile(prefix="visualhfsm-replay-")  # noqa: SIM115 - see close
        try:
            self._read(path)
            self.start = self._number("start")
        except BaseException:
            self._spool.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let the images go."""
        self._spool.close()

    def __len__(self) -> int:
        return len(self._records)

    def __getitem__(self, index: int) -> Record:
        channel, time, data = self._records[index]
        topic, message = self._channels[channel]
        try:
            decoded = self._decoders[message].decode(data)
        except (msgspec.MsgspecError, RecursionError) as error:
            raise RecordingError(f"message {index + 1} of {topic} is malformed: {error}") from None
        return Record(time - self.start, topic, decoded, data)

    @property
    def duration(self) -> int:
        """The ns from the start of the component to the last message."""
        return max((time for _, time, _ in self._records), default=self.start) - self.start

    def image(self, hash: str) -> bytes | None:
        """Return the bytes of an image, or None when the recording does not have them."""
        place = self._images.get(hash)
        if place is None:
            return None
        self._spool.seek(place[0])
        return self._spool.read(place[1])

    def number(self, name: str, default: int) -> int:
        """Return a number of the metadata."""
        return self._number(name) if name in self.metadata else default

    def _number(self, name: str) -> int:
        text = self.metadata.get(name, "")
        if not text.isascii() or not text.isdigit() or len(text) > 20:
            raise RecordingError(f"the recording is not one of a component: its {name} is {text[:40]!r}")
        return int(text)

    def _read(self, path: Path) -> None:
        from mcap.exceptions import InvalidMagic, McapError
        from mcap.stream_reader import StreamReader

        try:
            with path.open("rb") as file:
                reader = StreamReader(file, emit_chunks=True, record_size_limit=_LARGEST_RECORD)
                try:
                    for record in reader.records:
                        self._take(record)
                except InvalidMagic as error:
                    if not self.metadata:
                        raise RecordingError(f"{path} is not an MCAP file") from error
                    self.truncated = True
                except (McapError, *_BROKEN):
                    self.truncated = True
        except OSError as error:
            raise RecordingError(f"the recording {path} cannot be read: {error.strerror}") from error
        if not self.metadata:
            raise RecordingError(f"{path} is no recording of a component: it tells nothing of one")

    def _take(self, record: Any) -> None:  # noqa: ANN401 - the library's records have no common type
        from mcap.records import Attachment, Channel, Chunk, Metadata, Schema
        from mcap.records import Message as RawMessage

        if isinstance(record, Chunk):
            for inner in _records_in(record):
                self._take(inner)
        elif isinstance(record, RawMessage):
            self._take_message(record.channel_id, record.log_time, record.data)
        elif isinstance(record, Schema):
            self._schemas[record.id] = record.name
        elif isinstance(record, Channel):
            message = MESSAGES.get(self._schemas.get(record.schema_id, ""))
            if message is not None and record.message_encoding == "json":
                self._channels[record.id] = record.topic, message
        elif isinstance(record, Metadata) and record.name == METADATA:
            self.metadata = dict(record.metadata)
        elif isinstance(record, Attachment):
            self.attachments[record.name] = record.data.decode("utf-8", "surrogateescape")

    def _take_message(self, channel: int, time: int, data: bytes) -> None:
        if channel not in self._channels:
            return
        kind = self._channels[channel][1]
        if kind is Image:
            try:
                image = self._decoders[Image].decode(data)
            except (msgspec.MsgspecError, RecursionError) as error:
                raise RecordingError(f"an image is malformed: {error}") from None
            assert isinstance(image, Image)
            self._images[image.hash] = self._spool.seek(0, 2), len(image.data)
            self._spool.write(image.data)
            return
        if len(self._records) >= _MOST_RECORDS:
            raise RecordingError(f"the recording has more than {_MOST_RECORDS} messages")
        self._size += len(data)
        if self._size > _MOST_BYTES:
            raise RecordingError(f"the recording has more than {_MOST_BYTES} bytes of messages")
        if kind is Gap:
            gap = self._decoders[Gap].decode(data)
            self.lost += gap.lost if isinstance(gap, Gap) else 0
        self._records.append((channel, time, data))


def _records_in(chunk: Any) -> Iterator[Any]:  # noqa: ANN401
    """Yield the records of a chunk, whose size is checked before it is unpacked."""
    import lz4.frame  # type: ignore[import-untyped]
    import zstandard
    from mcap.records import Chunk
    from mcap.stream_reader import breakup_chunk

    size = chunk.uncompressed_size
    if size > _LARGEST_CHUNK:
        raise RecordingError(f"a chunk of {size} bytes where at most {_LARGEST_CHUNK} are taken")
    try:
        if chunk.compression == "zstd":
            if zstandard.frame_content_size(chunk.data) > size:
                raise ValueError("it unpacks to more than it says")
            data = zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=size)
        elif chunk.compression == "lz4":
            data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size)
        elif chunk.compression:
            raise RecordingError(f"chunks are compressed by {chunk.compression!r}: zstd and lz4 are known")
        else:
            data = chunk.data
    except (zstandard.ZstdError, RuntimeError, MemoryError) as error:
        raise ValueError(str(error)) from error
    plain = Chunk(
        compression="",
        data=data,
        message_start_time=chunk.message_start_time,
        message_end_time=chunk.message_end_time,
        uncompressed_crc=chunk.uncompressed_crc,
        uncompressed_size=size,
    )
    yield from breakup_chunk(plain, validate_crc=True)
