"""Read a recording within limits: nothing in it is executed, and no size in it is believed.

The file is read as a stream: in memory are one record and one unpacked chunk at a time. An image stays in the
file until somebody asks for it.
"""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

import msgspec

from .messages import MESSAGES, METADATA, SOURCES, Image, Message

__all__ = ["RawMessage", "RecordingError", "RecordingFile", "decode", "image_hash"]

LARGEST: Final = 64 << 20
"""Bytes of a record, of what a chunk unpacks to, and of all sources together."""
LARGEST_MESSAGE: Final = 4 << 20
"""Bytes of a message that is no image: the largest that the runtime writes has some 1 MiB."""
MOST_MESSAGES: Final = 5_000_000
"""Six hours of a behavior with four automata, which makes some 230 messages a second."""
MOST_UNPACKED: Final = 1 << 30
"""Bytes that any recording may unpack to; a large one may unpack to `HIGHEST_RATIO` times its size."""
HIGHEST_RATIO: Final = 1000
"""The images of the fake robot, which are flat, unpack to some 130 times what they take in the file."""

_MAGIC: Final = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _ATTACHMENT, _METADATA, _DATA_END = 3, 4, 5, 6, 9, 12, 15
_HEAD: Final = struct.Struct("<BQ")
"""Opcode and length of a record."""
_MESSAGE_HEAD: Final = struct.Struct("<HIQQ")
"""Channel, sequence, and both times of a message; its data follow."""
_BROKEN: Final = (ValueError, EOFError, struct.error, KeyError, IndexError, OverflowError, MemoryError)
# A file that was cut off ends in the middle of a record, which the library's parsers meet unprepared.
_DECODERS: Final = {kind: msgspec.json.Decoder(kind) for kind in MESSAGES.values()}


class RecordingError(Exception):
    """A recording cannot be read: it is none, is damaged at its beginning, or exceeds a limit."""


class RawMessage(NamedTuple):
    """A message that is not decoded yet; `time` is in ns since the epoch.

    `number` counts all messages of the file from 1, and `place` is where the record begins that holds it.
    """

    number: int
    topic: str
    kind: type[Message]
    time: int
    data: bytes
    place: int


class _Hash(msgspec.Struct):
    hash: str


class RecordingFile:
    """A recording on the disk, of which the beginning has been read. Raises RecordingError.

    `metadata` are those of the component; `sources` are the files that made it, by names such as
    `document/follow_ball.xml`.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.metadata: dict[str, str] = {}
        self.sources: dict[str, bytes] = {}
        self.truncated = False
        """Whether the last walk through the messages ended at a broken record, and not at the end."""
        try:
            self._read_head()
        except _BROKEN as error:
            if not self.metadata:
                message = f"{path} is not an MCAP file, or damaged at its beginning"
                raise RecordingError(message) from error
        except OSError as error:
            raise RecordingError(f"the recording {path} cannot be read: {error.strerror}") from error
        if not self.metadata:
            raise RecordingError(f"{path} is no recording of a component")

    @property
    def name(self) -> str:
        """The name of the component, at most 200 characters."""
        return self.metadata.get("name", "?")[:200]

    @property
    def start(self) -> int:
        """When the component started, in ns since the epoch; raises RecordingError."""
        text = self.metadata.get("start", "")
        if not (text.isascii() and text.isdigit() and len(text) < 20):
            raise RecordingError(f"the recording is not one of a component: its start is {text[:40]!r}")
        return int(text)

    def messages(self) -> Iterator[RawMessage]:
        """Yield the messages in the order of the file; one that was cut off ends where it is broken.

        Raises RecordingError when a limit is exceeded.
        """
        self.truncated = True  # until the end is found
        try:
            with self._path.open("rb") as file:
                most = max(MOST_UNPACKED, HIGHEST_RATIO * self._path.stat().st_size)
                yield from self._messages(file, most)
                self.truncated = False
        except OSError as error:
            raise RecordingError(f"the recording {self._path} cannot be read: {error.strerror}") from error
        except _BROKEN:
            return

    def image(self, place: int, hash: str) -> bytes | None:
        """Return the bytes of the image of a hash, from the record of the file that begins at `place`."""
        with self._path.open("rb") as file:
            file.seek(place)
            opcode, payload = _read_record(file)
            for inner, content in _unpack(opcode, payload):
                data = content[_MESSAGE_HEAD.size :]
                if inner == _MESSAGE and hash.encode() in data and _hash_of(data) == hash:
                    return msgspec.json.decode(data, type=Image).data
        return None

    def _read_head(self) -> None:
        """Read what stands before the first message: all metadata and sources do."""
        from mcap.records import Attachment, Metadata

        left = LARGEST
        with self._path.open("rb") as file:
            if file.read(len(_MAGIC)) != _MAGIC:
                raise ValueError("it begins otherwise")
            while True:
                opcode, payload = _read_record(file)
                if opcode == _METADATA:
                    found = Metadata.read(_stream(payload))
                    if found.name == METADATA:
                        self.metadata.update(found.metadata)
                elif opcode == _ATTACHMENT:
                    left -= len(payload)
                    attachment = Attachment.read(_stream(payload))
                    if left >= 0 and attachment.name.partition("/")[0] in SOURCES:
                        self.sources[attachment.name] = attachment.data
                elif opcode in (_CHUNK, _MESSAGE, _DATA_END):
                    return

    def _messages(self, file: IO[bytes], most: int) -> Iterator[RawMessage]:
        from mcap.records import Channel, Schema

        count = unpacked = 0
        schemas: dict[int, type[Message] | None] = {}
        channels: dict[int, tuple[str, type[Message]]] = {}
        place = file.seek(len(_MAGIC))
        while True:
            opcode, payload = _read_record(file)
            if opcode == _DATA_END:
                file.seek(-len(_MAGIC), os.SEEK_END)
                if file.read() != _MAGIC:
                    raise EOFError
                return
            for inner, content in _unpack(opcode, payload):
                unpacked += len(content)
                if unpacked > most:
                    raise RecordingError(f"the recording {self._path} unpacks to more than {most} bytes")
                if inner == _SCHEMA:
                    schema = Schema.read(_stream(content))
                    schemas[schema.id] = MESSAGES.get(schema.name)
                elif inner == _CHANNEL:
                    channel = Channel.read(_stream(content))
                    kind = schemas.get(channel.schema_id)
                    if kind is not None and channel.message_encoding == "json":
                        channels[channel.id] = channel.topic, kind
                elif inner == _MESSAGE:
                    count += 1
                    if count > MOST_MESSAGES:
                        raise RecordingError(
                            f"the recording {self._path} has more than {MOST_MESSAGES} messages"
                        )
                    number, _, time, _ = _MESSAGE_HEAD.unpack_from(content)
                    if number in channels:
                        topic, kind = channels[number]
                        if len(content) > LARGEST_MESSAGE and kind is not Image:
                            raise RecordingError(
                                f"a message of {topic} has {len(content)} bytes: "
                                f"at most {LARGEST_MESSAGE} are read"
                            )
                        yield RawMessage(count, topic, kind, time, content[_MESSAGE_HEAD.size :], place)
            place = file.tell()


def decode(raw: RawMessage) -> Message:
    """Return a message; raises RecordingError."""
    try:
        return _DECODERS[raw.kind].decode(raw.data)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as error:
        raise RecordingError(f"message {raw.number} of {raw.topic} is malformed: {error}") from None


def image_hash(raw: RawMessage) -> str:
    """Return the hash of an image, which is not decoded otherwise; raises RecordingError."""
    try:
        return _hash_of(raw.data)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as error:
        raise RecordingError(f"message {raw.number} of {raw.topic} is malformed: {error}") from None


def _read_record(file: IO[bytes]) -> tuple[int, bytes]:
    """Return opcode and payload of the next record; raises EOFError, and ValueError for one too large."""
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        raise EOFError
    opcode, length = _HEAD.unpack(head)
    if length > LARGEST:
        raise ValueError(f"a record of {length} bytes")
    payload = file.read(length)
    if len(payload) < length:
        raise EOFError
    return opcode, payload


def _unpack(opcode: int, payload: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield opcodes and payloads of the records in a chunk; another record is its own only one."""
    if opcode != _CHUNK:
        yield opcode, payload
        return
    from mcap.records import Chunk

    chunk = Chunk.read(_stream(payload))
    data = _decompress(chunk)
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("a chunk is damaged")
    at = 0
    while at < len(data):
        opcode, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if at + length > len(data):
            raise EOFError
        yield opcode, data[at : at + length]
        at += length


def _decompress(chunk: Any) -> bytes:  # noqa: ANN401 - the library is not typed
    """Return what a chunk holds; its size is checked before it is unpacked."""
    import zstandard

    if chunk.uncompressed_size > LARGEST:
        raise RecordingError(
            f"a chunk unpacks to {chunk.uncompressed_size} bytes: at most {LARGEST} are read"
        )
    if not chunk.compression:
        return bytes(chunk.data)
    if chunk.compression != "zstd":
        raise RecordingError(f"chunks are compressed by {chunk.compression[:40]!r}: zstd is known")
    try:
        if not 0 <= zstandard.frame_content_size(chunk.data) <= chunk.uncompressed_size:
            raise ValueError("a chunk unpacks to more than it says")
        return zstandard.ZstdDecompressor().decompress(chunk.data)
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from error


def _stream(payload: bytes) -> Any:  # noqa: ANN401
    from mcap.data_stream import ReadDataStream

    return ReadDataStream(io.BytesIO(payload))


def _hash_of(data: bytes) -> str:
    return msgspec.json.decode(data, type=_Hash).hash
