"""What travels in place of a payload whose large byte sequences stand in shared memory."""

from __future__ import annotations

from typing import Annotated, Final

import msgspec
from msgspec import Meta

from ..exceptions import MarshalException
from .memory_file import SLOTS
from .text import printable

__all__ = ["MemoryReference", "decode_reference", "encode_reference", "is_reference"]

_MOST_PARTS: Final = 256  # large byte sequences in one payload

# The first byte of an array in MessagePack; every payload is a map.
_ARRAY: Final = 0x90
_ARRAY_MASK: Final = 0xF0

_Number = Annotated[int, Meta(ge=0, lt=1 << 62)]


class MemoryReference(msgspec.Struct, array_like=True, frozen=True):
    """Where the large byte sequences of a payload are, one after the other, and the rest of it."""

    process: Annotated[int, Meta(ge=1, lt=1 << 31)]
    file: Annotated[int, Meta(ge=0, lt=1 << 31)]
    """The open file of that process that is the memory."""
    token: Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
    """Which nobody can guess: part of the memory's name."""
    slot: Annotated[int, Meta(ge=0, lt=SLOTS)]
    generation: Annotated[int, Meta(ge=1, lt=1 << 62)]
    """What the slot's header tells as long as nothing else was written there."""
    lent: bool
    """Whether it is for one reader, who gives it back."""
    places: Annotated[tuple[_Number, ...], Meta(max_length=_MOST_PARTS)]
    sizes: Annotated[tuple[_Number, ...], Meta(max_length=_MOST_PARTS)]
    rest: bytes

    @property
    def size(self) -> int:
        """Bytes of the payload, roughly."""
        return len(self.rest) + sum(self.sizes)


_encoder: Final = msgspec.msgpack.Encoder()
_decoder: Final = msgspec.msgpack.Decoder(MemoryReference)


def is_reference(payload: bytes) -> bool:
    """Return whether what travelled is a reference, and not the payload itself."""
    return bool(payload) and payload[0] & _ARRAY_MASK == _ARRAY


def encode_reference(reference: MemoryReference) -> bytes:
    """Return a reference as it travels."""
    return _encoder.encode(reference)


def decode_reference(payload: bytes, what: str) -> MemoryReference:
    """Return the reference that travelled; raises MarshalException for a malformed one."""
    try:
        reference = _decoder.decode(payload)
    except (ValueError, RecursionError, OverflowError) as error:
        raise MarshalException(f"{what}: reference to shared memory: {printable(str(error))}") from error
    if len(reference.places) != len(reference.sizes):
        raise MarshalException(f"{what}: reference to shared memory: as many places as sizes are wanted")
    return reference
