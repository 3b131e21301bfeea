"""What travels beside a payload: which interface, which call or sample, and when."""

from __future__ import annotations

import math
import time
from typing import Annotated, Final

import msgspec
from msgspec import Meta

from .exceptions import MarshalException

__all__ = [
    "NO_ATTACHMENT",
    "Attachment",
    "decode_attachment",
    "encode_call_attachment",
    "encode_sample_attachment",
]

_LIMIT: Final = 512  # bytes; ours has some 100

_Name = Annotated[str, Meta(max_length=128)]


class Attachment(msgspec.Struct, array_like=True, frozen=True):
    """The attachment of a call or a stream sample, on the wire an array."""

    fingerprint: _Name = ""
    """Fingerprint of the interface that the sender was generated from; empty when it knows none."""
    sequence: int = 0
    """Number of the call in its session, or of the sample in its stream."""
    robot_time: float = math.nan
    """Robot time of a sample in s; nan when there is none."""
    wall_time: float = 0.0
    """The sender's wall time in s since the epoch."""
    call_id: _Name = ""
    """`{session id}/{number}` of a call, empty in a sample."""
    timeout: float = 0.0
    """Seconds after which the caller gives up; 0 in a sample."""

    @property
    def client(self) -> str:
        """The id of the calling session."""
        return self.call_id.partition("/")[0]


NO_ATTACHMENT: Final = Attachment()

_encoder: Final = msgspec.msgpack.Encoder()
_decoder: Final = msgspec.msgpack.Decoder(Attachment)


def encode_call_attachment(fingerprint: str, number: int, client: str, timeout: float) -> bytes:
    """Return the attachment of a call as it travels."""
    # A tuple rather than the struct: it saves a microsecond in every call.
    return _encoder.encode((fingerprint, number, math.nan, time.time(), f"{client}/{number}", timeout))


def encode_sample_attachment(fingerprint: str, sequence: int, robot_time: float) -> bytes:
    """Return the attachment of a stream sample as it travels."""
    return _encoder.encode((fingerprint, sequence, robot_time, time.time(), "", 0.0))


def decode_attachment(data: bytes) -> Attachment:
    """Return the attachment that arrived; raises MarshalException for a malformed one."""
    if len(data) > _LIMIT:
        raise MarshalException(f"attachment: {len(data)} bytes where at most {_LIMIT} are taken")
    try:
        return _decoder.decode(data)
    except (ValueError, RecursionError, OverflowError) as error:
        raise MarshalException(f"attachment: {error}") from error
