"""Read the messages of a recording; what it holds is checked, and nothing in it is run."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

from visualhfsm.errors import VisualHfsmError

__all__ = ["RawMessage", "read_messages"]

_LARGEST: Final = 64 << 20
"""Bytes of a record, and of what a chunk unpacks to."""
_BROKEN: Final = (ValueError, EOFError, struct.error, KeyError, IndexError, OverflowError, MemoryError)
# A file that was cut off ends in the middle of a record, which the library's parser meets unprepared.


class RawMessage(NamedTuple):
    """A message in JSON, the name of its schema, and its time in ns."""

    schema: str
    time: int
    data: bytes


def read_messages(path: Path) -> Iterator[RawMessage]:
    """Yield the messages in JSON in the order of the file; one that was cut off ends where it is broken.

    Raises VisualHfsmError when it cannot be read at all.
    """
    from mcap.exceptions import McapError
    from mcap.records import Channel, Message, Schema

    schemas: dict[int, str] = {}
    channels: dict[int, str] = {}
    try:
        for record in _records(path):
            match record:
                case Message(channel_id=channel, log_time=time, data=data) if channel in channels:
                    yield RawMessage(channels[channel], time, data)
                case Schema(id=number, name=name):
                    schemas[number] = name
                case Channel(id=number, schema_id=schema, message_encoding="json"):
                    channels[number] = schemas.get(schema, "")
    except OSError as error:
        raise VisualHfsmError(f"the recording {path} cannot be read: {error.strerror}") from error
    except (McapError, *_BROKEN):
        return


def _records(path: Path) -> Iterator[Any]:
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    with path.open("rb") as file:
        for record in StreamReader(file, emit_chunks=True, record_size_limit=_LARGEST).records:
            if isinstance(record, Chunk):
                yield from _in_chunk(record)
            else:
                yield record


def _in_chunk(chunk: Any) -> Iterator[Any]:  # noqa: ANN401 - the library's records have no common type
    """Yield the records of a chunk, whose size is known before it is unpacked."""
    import zstandard
    from mcap.stream_reader import breakup_chunk

    if chunk.compression not in ("", "zstd"):
        raise ValueError(f"chunks are compressed by {chunk.compression!r}: zstd is known")
    if chunk.compression:
        size = zstandard.frame_content_size(chunk.data)
        if not 0 <= size <= min(chunk.uncompressed_size, _LARGEST):
            raise ValueError("a chunk is too large")
    try:
        yield from breakup_chunk(chunk, validate_crc=True)
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from error
