"""What travels beside a payload: which interface, which call or sample, and when."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Final

import msgspec
from msgspec import Meta

from ..exceptions import MarshalException

__all__ = [
    "NO_ATTACHMENT",
    "Attachment",
    "check_context",
    "decode_attachment",
    "encode_call_attachment",
    "encode_sample_attachment",
]

_LIMIT: Final = 512  # bytes without a context; ours has some 100
_CONTEXT_LIMIT: Final = 4096  # bytes of keys and values

# Refused is also what is not a number: servants and readers wait and compute by these.
_WallTime = Annotated[float, Meta(ge=0.0, le=1e11)]
_Timeout = Annotated[float, Meta(ge=0.0, le=86_400.0)]
_Number = Annotated[int, Meta(ge=0)]
_Name = Annotated[str, Meta(max_length=128)]
_Context = Annotated[dict[_Name, Annotated[str, Meta(max_length=1024)]], Meta(max_length=32)]


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
    """`{session id}/{number}` of a call; of a sample what tells its stream from the one before a restart."""
    timeout: _Timeout = 0.0
    """Seconds after which the caller gives up; 0 in a sample."""
    context: _Context = {}
    """What the caller says beside the parameters; absent when that is nothing."""

    @property
    def stream(self) -> str:
        """What tells the stream of a sample from the one of the same servant before a restart."""
        return self.call_id

    @property
    def client(self) -> str:
        """The id of the calling session."""
        return self.call_id.partition("/")[0]


NO_ATTACHMENT: Final = Attachment()

_encoder: Final = msgspec.msgpack.Encoder()
_decoder: Final = msgspec.msgpack.Decoder(Attachment)
_context_decoder: Final = msgspec.msgpack.Decoder(_Context)


def encode_call_attachment(
    fingerprint: str, number: int, client: str, timeout: float, context: Mapping[str, str] | None = None
) -> bytes:
    """Return the attachment of a call as it travels; `context` is one that `check_context` accepts."""
    # A tuple rather than the struct: it saves a microsecond in every call.
    about = (fingerprint, number, math.nan, time.time(), f"{client}/{number}", timeout)
    return _encoder.encode((*about, dict(context)) if context else about)


def check_context(context: Mapping[str, str]) -> Mapping[str, str]:
    """Return a copy of a context.

    Raises MarshalException when it is none: at most 32 texts of at most 1024 characters by names of at most
    128, 4096 bytes in all.
    """
    try:
        encoded = _encoder.encode(dict(context))
        checked = _context_decoder.decode(encoded)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise MarshalException(f"context: {error}") from error
    if len(encoded) > _CONTEXT_LIMIT:
        raise MarshalException(f"context: {len(encoded)} bytes where at most {_CONTEXT_LIMIT} travel")
    return MappingProxyType(checked)


def encode_sample_attachment(
    fingerprint: str, sequence: int, robot_time: float, stream: str = "", wall_time: float | None = None
) -> bytes:
    """Return the attachment of a stream sample as it travels; it is sent now, or was at `wall_time`."""
    sent = time.time() if wall_time is None else wall_time
    return _encoder.encode((fingerprint, sequence, robot_time, sent, stream, 0.0))


def decode_attachment(data: bytes) -> Attachment:
    """Return the attachment that arrived; raises MarshalException for a malformed one."""
    if len(data) > _LIMIT + _CONTEXT_LIMIT:
        raise MarshalException(
            f"attachment: {len(data)} bytes where at most {_LIMIT + _CONTEXT_LIMIT} are taken"
        )
    try:
        return _decoder.decode(data)
    except (ValueError, RecursionError, OverflowError) as error:
        raise MarshalException(f"attachment: {error}") from error
