"""A payload in pieces: large byte sequences stay where they are until they are sent, and after they came."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import msgspec
from msgspec import inspect

from ._values import Value
from .exceptions import MarshalException

__all__ = ["LARGE", "Parted", "Pieces", "byte_sequences", "put_back", "split_off", "take_out"]

LARGE: Final = 1 << 16
"""Bytes from which a byte sequence is worth a piece of its own."""

_LONGEST: Final = (1 << 32) - 1  # of a byte sequence in MessagePack
_HEADER_SIZE: Final = 5  # of a large byte sequence there: a type byte and the length
_EMPTY: Final = b"\xc4\x00"  # a byte sequence of none

# Stands in the encoding for bytes that were taken out. Nobody else knows it, so it is nowhere else in there.
_MARK: Final = os.urandom(16)


class Parted(NamedTuple):
    """A payload without its large byte sequences, which are empty there, and these beside it."""

    rest: bytes
    places: tuple[int, ...]
    """Of each large byte sequence which one it is among all of the payload's type."""
    large: Sequence[bytes]


class Pieces:
    """A payload that was not yet copied into one: small parts, and between each two a large byte sequence."""

    __slots__ = ("_size", "_small", "large", "places")

    def __init__(self, small: Sequence[bytes], large: Sequence[bytes], places: tuple[int, ...]) -> None:
        self._small: Final = small
        self.large: Final = large
        self.places: Final = places
        self._size: Final = sum(map(len, small)) + sum(map(len, large))

    def __len__(self) -> int:
        return self._size

    def __bytes__(self) -> bytes:
        first, *others = self._small
        parts = [first]
        for large, small in zip(self.large, others, strict=True):
            parts += (large, small)
        return b"".join(parts)

    def without_large(self) -> bytes:
        """Return the payload with empty byte sequences in place of the large ones."""
        *before, last = self._small
        return b"".join(small[:-_HEADER_SIZE] + _EMPTY for small in before) + last


def byte_sequences(struct: type[msgspec.Struct]) -> tuple[tuple[str, ...], ...]:
    """Return the ways to the byte sequences in a struct: the names of the members on each of them."""
    return tuple(_paths(inspect.type_info(struct)))


def take_out(
    struct: msgspec.Struct, paths: tuple[tuple[str, ...], ...]
) -> tuple[msgspec.Struct, dict[int, bytes]]:
    """Return a copy of a struct in which marks stand for the large byte sequences, and these by place."""
    taken: dict[int, bytes] = {}
    for place, path in enumerate(paths):
        struct = _without(struct, path, place, taken)
    return struct, taken


def split_off(encoded: bytes, taken: dict[int, bytes]) -> Pieces:
    """Return the payload that an encoding with marks stands for."""
    return Pieces(encoded.split(_MARK), list(taken.values()), tuple(taken))


def put_back(struct: msgspec.Struct, paths: tuple[tuple[str, ...], ...], payload: Parted, what: str) -> None:
    """Give a struct, decoded from what is left of a payload, its large byte sequences.

    Raises MarshalException when they do not belong there.
    """
    for place, large in zip(payload.places, payload.large, strict=True):
        if not 0 <= place < len(paths):
            raise MarshalException(f"{what}: large bytes where there are none")
        *way, name = paths[place]
        holder = struct
        for member in way:
            holder = getattr(holder, member)
        setattr(holder, name, large)


def _paths(node: inspect.Type) -> list[tuple[str, ...]]:
    if isinstance(node, inspect.BytesType):
        return [()]
    if isinstance(node, inspect.StructType) and not issubclass(node.cls, Value):
        return [(field.name, *rest) for field in node.fields for rest in _paths(field.type)]
    return []


def _without(struct: Any, path: tuple[str, ...], place: int, taken: dict[int, bytes]) -> Any:  # noqa: ANN401
    """Return a struct, or whatever stands in its place, with the bytes at the end of a path taken out."""
    if not isinstance(struct, msgspec.Struct):
        return struct
    name, *rest = path
    value = getattr(struct, name, None)  # it may be another struct, which the receiver refuses
    if rest:
        changed = _without(value, tuple(rest), place, taken)
    elif isinstance(value, bytes) and LARGE <= len(value) <= _LONGEST:
        taken[place] = value
        # MessagePack's header of so many bytes.
        changed = msgspec.Raw(b"\xc6" + len(value).to_bytes(4, "big") + _MARK)
    else:
        return struct
    return struct if changed is value else msgspec.structs.replace(struct, **{name: changed})
