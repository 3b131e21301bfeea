"""A payload in pieces: large byte sequences stay where they are until they are sent."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Final

import msgspec
from msgspec import inspect

from .values import Value

__all__ = ["LARGE", "Pieces", "byte_sequences", "split_off", "take_out"]

LARGE: Final = 1 << 16
"""Bytes from which a byte sequence is worth a piece of its own, and a payload shared memory."""

_LONGEST: Final = (1 << 32) - 1  # of a byte sequence in MessagePack

# Stands in the encoding for bytes that were taken out. Nobody else knows it, so it is nowhere else in there.
_MARK: Final = os.urandom(16)


class Pieces:
    """The parts of a payload, one after the other: they were not yet copied into one."""

    __slots__ = ("_size", "parts")

    def __init__(self, parts: Sequence[bytes]) -> None:
        self.parts: Final = parts
        self._size: Final = sum(map(len, parts))

    def __len__(self) -> int:
        return self._size

    def __bytes__(self) -> bytes:
        return b"".join(self.parts)


def byte_sequences(struct: type[msgspec.Struct]) -> tuple[tuple[str, ...], ...]:
    """Return the ways to the byte sequences in a struct: the names of the members on each of them."""
    return tuple(_paths(inspect.type_info(struct)))


def take_out(
    struct: msgspec.Struct, paths: tuple[tuple[str, ...], ...]
) -> tuple[msgspec.Struct, list[bytes]]:
    """Return a copy of a struct in which marks stand for the large byte sequences, and these."""
    taken: list[bytes] = []
    for path in paths:
        struct = _without(struct, path, taken)
    return struct, taken


def split_off(encoded: bytes, taken: Sequence[bytes]) -> Pieces:
    """Return the payload that an encoding with marks stands for."""
    first, *others = encoded.split(_MARK)
    parts: list[bytes] = [first]
    for large, following in zip(taken, others, strict=True):
        parts += (large, following)
    return Pieces([part for part in parts if part])


def _paths(node: inspect.Type) -> list[tuple[str, ...]]:
    if isinstance(node, inspect.BytesType):
        return [()]
    if isinstance(node, inspect.StructType) and not issubclass(node.cls, Value):
        return [(field.name, *rest) for field in node.fields for rest in _paths(field.type)]
    return []


def _without(struct: Any, path: tuple[str, ...], taken: list[bytes]) -> Any:  # noqa: ANN401
    """Return a struct, or whatever stands in its place, with the bytes at the end of a path taken out."""
    if not isinstance(struct, msgspec.Struct):
        return struct
    name, *rest = path
    value = getattr(struct, name)
    if rest:
        changed = _without(value, tuple(rest), taken)
    elif isinstance(value, bytes) and LARGE <= len(value) <= _LONGEST:
        taken.append(value)
        # MessagePack's header of so many bytes.
        changed = msgspec.Raw(b"\xc6" + len(value).to_bytes(4, "big") + _MARK)
    else:
        return struct
    return struct if changed is value else msgspec.structs.replace(struct, **{name: changed})
