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

# Refused is also what is not a number: servants and readers wait and compute by these.
_WallTime = Annotated[float, Meta(ge=0.0, le=1e11)]
_Timeout = Annotated[float, Meta(ge=0.0, le=86_400.0)]
_Number = Annotated[int, Meta(ge=0)]
_Name = Annotated[str, Meta(max_length=128)]


class Attachment(msgspec.Struct, array_like=True, frozen=True):
    """The attachment of a call or a stream sample, on the wire an array."""

    fingerprint: _Name = ""
    """Fingerprint of the interface that the sender was generated from; empty when it knows none."""
    sequence: _Number = 0
    """Number of the call in its session, or of the sample in its stream."""
    robot_time: float = math.nan
    """Robot time of a sample in s; nan when there is none."""
    wall_time: _WallTime = 0.0
    """The sender's wall time in s since the epoch."""
    call_id: _Name = ""
    """`{session id}/{number}` of a call; of a sample the id of its stream, another after each restart."""
    timeout: _Timeout = 0.0
    """Seconds after which the caller gives up; 0 in a sample, and where nobody waits."""

    @property
    def stream(self) -> str:
        """The id of a sample's stream."""
        return self.call_id

    @property
    def client(self) -> str:
        """The id of the calling session."""
        return self.call_id.partition("/")[0]


NO_ATTACHMENT: Final = Attachment()

_encode: Final = msgspec.msgpack.Encoder().encode
_decode: Final = msgspec.msgpack.Decoder(Attachment).decode


def encode_call_attachment(fingerprint: str, number: int, client: str, timeout: float) -> bytes:
    """Return the attachment of a call as it travels; `timeout` is 0 for one without an answer."""
    # A tuple rather than the struct: it saves a microsecond in every call.
    return _encode((fingerprint, number, math.nan, time.time(), f"{client}/{number}", timeout))


def encode_sample_attachment(fingerprint: str, sequence: int, robot_time: float, stream: str = "") -> bytes:
    """Return the attachment of a stream sample as it travels, sent now."""
    return _encode((fingerprint, sequence, robot_time, time.time(), stream, 0.0))


def decode_attachment(data: bytes) -> Attachment:
    """Return the attachment that arrived; raises MarshalException for a malformed one."""
    if len(data) > _LIMIT:
        raise MarshalException(f"attachment: {len(data)} bytes where at most {_LIMIT} are taken")
    try:
        return _decode(data)
    except (ValueError, RecursionError, OverflowError) as error:
        raise MarshalException(f"attachment: {error}") from error
