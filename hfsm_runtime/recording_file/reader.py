"""Read a recording within limits: nothing in it is executed, and no size in it is trusted.

The file is read as a stream: only one record and one unpacked chunk are in memory. An image stays in the file
until it is read.
"""

from __future__ import annotations

import io
import os
import re
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final, NamedTuple, TypeVar

import msgspec
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Chunk, Footer, Metadata, Schema, Statistics

from zenoh_ice.data import typed

from .messages import FORMAT, MESSAGES, METADATA, SOURCES, Image, Message, Picture

LARGEST_RECORD: Final = 64 << 20
"""Most bytes of a record, of an unpacked chunk, and of all sources together."""
LARGEST_MESSAGE: Final = 4 << 20
"""Most bytes of a message other than an image: the largest that the runtime writes has about 1 MiB."""

_FILE: Final = re.compile(r"(document|component|extension)/([\w.\- ]{1,200}\.(?:xml|py))")
_MAGIC: Final = b"\x89MCAP0\r\n"
_SCHEMA = 3
_CHANNEL = 4
_MESSAGE = 5
_CHUNK = 6
_ATTACHMENT = 9
_STATISTICS = 11
_METADATA = 12
_DATA_END = 15
_END_SIZE: Final = 37
"""Bytes of the last record, which says where the summary begins, and of what follows it."""
_MOST_SUMMARIES: Final = 1000
"""Records of a summary that are looked at; ours has the statistics after some thirty."""
_HEAD: Final = struct.Struct("<BQ")
"""Opcode and length of a record."""
_MESSAGE_HEAD: Final = struct.Struct("<HIQQ")
"""Channel, sequence, and both times of a message; its data follow."""
_BROKEN: Final = (
    ValueError, EOFError, struct.error, KeyError, IndexError, OverflowError, MemoryError, zstandard.ZstdError,
    McapError,
)  # fmt: skip
"""Exceptions for a truncated file: the library's parsers do not expect the end within a record."""


@dataclass(frozen=True)
class ReadLimits:
    """Limits of what is read of a recording."""

    most_messages: int = 5_000_000
    """Six hours of a behavior with four automata, which makes about 230 messages a second."""
    few_messages: int = 100_000
    """Messages that any recording may have; a large one may have one for each of its bytes.

    A genuine message takes several bytes, even compressed, since its time differs from the one before.
    """
    most_unpacked: int = 1 << 30
    """Bytes that any recording may unpack to; a large one may unpack to `highest_ratio` times its size."""
    highest_ratio: int = 1000
    """The images of the fake robot, which are flat, unpack to about 130 times their size in the file."""


READ_LIMITS: Final = ReadLimits()

T = TypeVar("T")
P = TypeVar("P", Image, Picture)


class RecordingError(Exception):
    """A file is not a recording, is damaged at its beginning, or exceeds a limit."""


class RawMessage(NamedTuple):
    """A message that is not decoded yet; `time` is in ns since the epoch.

    `number` counts all messages of the file from 1; `place` is the start of the record that holds it.
    """

    number: int
    topic: str
    kind: type[Message]
    time: int
    data: bytes
    place: int


class ImageHash(msgspec.Struct):
    """The hash of an image, for which its pixels need not be decoded."""

    hash: str


class RecordingFile:
    """A recording on disk; its beginning has been read. Raises RecordingError.

    `metadata` are those of the component, `name` is its name and `start` when it started, in ns since the
    epoch; `version` is that of the VisualHFSM that recorded it; `sources` are the files that made it, by
    names such as `document/follow_ball.xml`, and `altered` the names of those whose content is not what was
    written.
    """

    def __init__(self, path: Path, limits: ReadLimits = READ_LIMITS) -> None:
        self._path = path
        self._limits = limits
        self.metadata: dict[str, str] = {}
        self.sources: dict[str, bytes] = {}
        self.altered: list[str] = []
        self.truncated = False
        """True if the last iteration over the messages ended at a broken record instead of the end."""
        try:
            with suppress(*_BROKEN):  # what is missing is read below
                self._read_head()
        except OSError as error:
            raise RecordingError(f"the recording {path} cannot be read: {error.strerror}") from error
        start = self.metadata.get("start", "")
        if not (start.isascii() and start.isdigit() and len(start) < 20):
            raise RecordingError(
                f"{path} is not a recording of a component: not an MCAP file, or a damaged one"
            )
        self.version = self.metadata.get("visualhfsm", "unknown")
        if self.metadata.get("format", FORMAT) != FORMAT:
            text = f"{path} has a format that is not known here: read it with the version that recorded it"
            raise RecordingError(f"{text}, VisualHFSM {self.version}")
        self.start = int(start)
        self.name = self.metadata.get("name", "?")[:200]

    @property
    def files(self) -> dict[str, tuple[str, bytes]]:
        """Names and contents of the files that made the component, by kind: document, component, extension.

        A file of any other name, such as one with a path in it, is left out.
        """
        matches = ((_FILE.fullmatch(name), content) for name, content in self.sources.items())
        return {match[1]: (match[2], content) for match, content in matches if match}

    @property
    def end(self) -> int | None:
        """When its last message was written, in ns since the epoch; None if it was cut off."""
        with suppress(*_BROKEN, OSError), self._path.open("rb") as file:
            file.seek(-_END_SIZE, os.SEEK_END)
            file.seek(Footer.read(_stream(_read_record(file)[1])).summary_start)
            for _ in range(_MOST_SUMMARIES):
                opcode, payload = _read_record(file)
                if opcode == _STATISTICS:
                    return int(Statistics.read(_stream(payload)).message_end_time)
        return None

    def messages(self) -> Iterator[RawMessage]:
        """Yield the messages in the order of the file; in a truncated file, those before the broken record.

        Raises RecordingError when a limit is exceeded.
        """
        self.truncated = True  # until the end is found
        try:
            with suppress(*_BROKEN), self._path.open("rb") as file:
                size, limits = self._path.stat().st_size, self._limits
                most = max(limits.most_unpacked, limits.highest_ratio * size)
                most_messages = min(limits.most_messages, max(limits.few_messages, size))
                yield from self._messages(file, most, most_messages)
                self.truncated = False
        except OSError as error:
            raise RecordingError(f"the recording {self._path} cannot be read: {error.strerror}") from error

    def image_at(self, place: int, hash: str, kind: type[P]) -> P | None:
        """Return the image of a hash, from the record of the file that begins at `place`."""
        with self._path.open("rb") as file:
            file.seek(place)
            for opcode, content in _unpack(*_read_record(file)):
                data = content[_MESSAGE_HEAD.size :]
                if opcode == _MESSAGE and hash.encode() in data:
                    image = typed.from_json(data, kind)
                    if image.hash == hash:
                        return image
        return None

    def _read_head(self) -> None:
        """Read everything before the first message: all metadata and sources."""
        left = LARGEST_RECORD
        with self._path.open("rb") as file:
            for _, (opcode, payload) in _records(file):
                if opcode == _METADATA:
                    found = Metadata.read(_stream(payload))
                    if found.name == METADATA:
                        self.metadata.update(found.metadata)
                elif opcode == _ATTACHMENT:
                    left -= len(payload)
                    attachment = Attachment.read(_stream(payload))
                    if left < 0 or attachment.name.partition("/")[0] not in SOURCES:
                        continue
                    crc = int.from_bytes(payload[-4:], "little")  # 0: it was written without one
                    if crc and crc != zlib.crc32(payload[:-4]):
                        self.altered.append(attachment.name)
                    else:
                        self.sources[attachment.name] = attachment.data
                elif opcode in (_CHUNK, _MESSAGE):
                    return

    def _messages(self, file: IO[bytes], most: int, most_messages: int) -> Iterator[RawMessage]:
        count = unpacked = 0
        schemas: dict[int, type[Message] | None] = {}
        channels: dict[int, tuple[str, type[Message]]] = {}
        records = ((place, record) for place, outer in _records(file) for record in _unpack(*outer))
        for place, (opcode, content) in records:
            unpacked += len(content)
            if unpacked > most:
                raise RecordingError(f"the recording {self._path} unpacks to more than {most} bytes")
            if opcode == _SCHEMA:
                schema = Schema.read(_stream(content))
                schemas[schema.id] = MESSAGES.get(schema.name)
            elif opcode == _CHANNEL:
                channel = Channel.read(_stream(content))
                if (kind := schemas.get(channel.schema_id)) and channel.message_encoding == "json":
                    channels[channel.id] = channel.topic, kind
            elif opcode == _MESSAGE:
                count += 1
                if count > most_messages:
                    raise RecordingError(f"the recording {self._path} has more than {most_messages} messages")
                number, _, time, _ = _MESSAGE_HEAD.unpack_from(content)
                if number in channels:
                    topic, kind = channels[number]
                    if (size := len(content)) > LARGEST_MESSAGE and kind is not Image:
                        raise RecordingError(
                            f"a message of {topic} has {size} bytes: at most {LARGEST_MESSAGE} are read"
                        )
                    yield RawMessage(count, topic, kind, time, content[_MESSAGE_HEAD.size :], place)


def decode(raw: RawMessage, kind: type[T]) -> T:
    """Return a message, all of it or some of its members; raises RecordingError."""
    try:
        return typed.from_json(raw.data, kind)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as error:
        raise RecordingError(f"message {raw.number} of {raw.topic} is malformed: {error}") from None


def _records(file: IO[bytes]) -> Iterator[tuple[int, tuple[int, bytes]]]:
    """Yield the records, each with its place; raises EOFError where the file was cut off."""
    if file.read(len(_MAGIC)) != _MAGIC:
        raise ValueError("it begins otherwise")
    while True:
        place = file.tell()
        record = _read_record(file)
        if record[0] == _DATA_END:
            file.seek(-len(_MAGIC), os.SEEK_END)
            if file.read() != _MAGIC:
                raise EOFError
            return
        yield place, record


def _read_record(file: IO[bytes]) -> tuple[int, bytes]:
    """Return opcode and payload of the next record; raises EOFError, and ValueError for one too large."""
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        raise EOFError
    opcode, length = _HEAD.unpack(head)
    if length > LARGEST_RECORD:
        raise ValueError(f"a record of {length} bytes")
    payload = file.read(length)
    if len(payload) < length:
        raise EOFError
    return opcode, payload


def _unpack(opcode: int, payload: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield opcodes and payloads of the records in a chunk; any other record yields itself.

    The size of a chunk is checked before it is unpacked.
    """
    if opcode != _CHUNK:
        yield opcode, payload
        return
    chunk = Chunk.read(_stream(payload))
    size, data = chunk.uncompressed_size, chunk.data
    if size > LARGEST_RECORD:
        raise RecordingError(f"a chunk unpacks to {size} bytes: at most {LARGEST_RECORD} are read")
    if chunk.compression == "zstd":
        if not 0 <= zstandard.frame_content_size(data) <= size:
            raise ValueError("a chunk unpacks to more than it says")
        data = zstandard.ZstdDecompressor().decompress(data)
    elif chunk.compression:
        raise RecordingError(f"chunks are compressed by {chunk.compression[:40]!r}: zstd is known")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("a chunk is damaged")
    records = io.BytesIO(data)
    while records.tell() < len(data):
        yield _read_record(records)


def _stream(payload: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(payload))
