"""Turn structs into MessagePack and back, checking everything that comes from outside.

Large byte sequences stay where they are until they are sent, and after they came: a payload is in pieces
then.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from operator import attrgetter
from typing import Any, Final, Generic, NamedTuple, Protocol, TypeVar

import msgspec
from msgspec import inspect

from ._values import TYPE_FIELD, Arrival, Reference, Resolve, Value, arrives_as_it_is, derived_classes
from .exceptions import MarshalException
from .text import printable

__all__ = [
    "DECODE_ERRORS",
    "LARGE",
    "Buffer",
    "Codec",
    "Parted",
    "Pieces",
    "byte_sequences",
    "encode",
    "misfit",
    "put_back",
    "split_off",
    "take_out",
]

LARGE: Final = 1 << 16
"""Bytes from which a byte sequence is worth a piece of its own."""

_LONGEST: Final = (1 << 32) - 1  # of a byte sequence in MessagePack
_HEADER_SIZE: Final = 5  # of a large byte sequence there: a type byte and the length
_EMPTY: Final = b"\xc4\x00"  # a byte sequence of none

# Stands in the encoding for bytes that were taken out. Nobody else knows it, so it is nowhere else in there.
_MARK: Final = os.urandom(16)

S = TypeVar("S", bound=msgspec.Struct)

_PATH: Final = re.compile(r" - at `(?:key in )?(\$[^`]*)`$")
_MISSING_FIELD: Final = re.compile(r"missing required field `([^`]+)`")
_INVALID: Final = "Invalid value "
# What msgspec raises for values that it cannot encode.
_ENCODE_ERRORS: Final = (TypeError, ValueError, OverflowError, RecursionError, BufferError)

DECODE_ERRORS: Final = (TypeError, ValueError, OverflowError, RecursionError, MemoryError)
"""What msgspec raises for payloads that it cannot decode.

TypeError for types that it cannot decode at all: the interfaces that a servant tells of at run time may have
such.
"""


class Buffer(Protocol):
    """Bytes that arrived, of which the size is known before they are copied."""

    def __len__(self) -> int: ...

    def __bytes__(self) -> bytes: ...


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


def _encode_foreign(value: object) -> object:
    """Return what msgspec can encode in place of proxies, and of arrays and scalars of numpy and its like."""
    if isinstance(value, Reference):
        return value.ice_toWire()
    try:
        view = memoryview(value)  # type: ignore[arg-type]
    except TypeError:
        pass
    else:
        if view.format == "B" and view.ndim > 0:
            return view.cast("B") if view.c_contiguous else view.tobytes()
    to_list = getattr(value, "tolist", None)
    if to_list is None:
        raise TypeError(f"a {type(value).__name__} cannot travel")
    return to_list()


_encoder: Final = msgspec.msgpack.Encoder(enc_hook=_encode_foreign)


def encode(value: object, what: str) -> bytes:
    """Return a value as MessagePack.

    Raises MarshalException, beginning with `what`, when it holds something that cannot travel.
    """
    try:
        return _encoder.encode(value)
    except _ENCODE_ERRORS as error:
        raise MarshalException(f"{what}: {_why_not_encoded(error)}") from error


class Codec(Generic[S]):
    """Encode and decode one struct, by parameter name, and the plain values that stand for it in Python.

    No field stands for None, one field for its value, several for a tuple.
    """

    def __init__(self, struct: type[S]) -> None:
        self.struct = struct
        self.fields: tuple[str, ...] = struct.__struct_fields__
        by_position = len(struct.__match_args__) == len(self.fields)
        self._make: Callable[..., S] = struct if by_position else self._make_by_name

    @cached_property
    def holds_bytes(self) -> bool:
        """Whether a byte sequence stands anywhere in the type: such payloads may be larger."""
        return _holds_bytes(inspect.type_info(self.struct), set())

    @cached_property
    def _decoder(self) -> msgspec.msgpack.Decoder[S]:
        # Made when first needed: the struct may refer to types defined after the operation.
        return msgspec.msgpack.Decoder(self.struct)

    @cached_property
    def _arrival(self) -> Arrival[S] | None:
        """What decodes instead, where msgspec alone cannot."""
        return None if arrives_as_it_is(self.struct) else Arrival(self.struct)

    @cached_property
    def _byte_sequences(self) -> tuple[tuple[str, ...], ...]:
        return byte_sequences(self.struct) if self.holds_bytes else ()

    @cached_property
    def value_of(self) -> Callable[[S], object]:
        """Returns what stands for a struct: None, a value or a tuple."""
        return attrgetter(*self.fields) if self.fields else _nothing

    def _make_by_name(self, *values: object) -> S:
        if len(values) != len(self.fields):
            raise TypeError(f"{len(values)} values where {len(self.fields)} are wanted")
        return self.struct(**dict(zip(self.fields, values, strict=True)))

    def pack(self, values: tuple[object, ...], what: str) -> bytes:
        """Return the struct of these field values as MessagePack.

        Raises TypeError for a wrong number of values, MarshalException for one that cannot travel.
        """
        struct = self._make(*values)
        try:
            return _encoder.encode(struct)
        except _ENCODE_ERRORS as error:
            raise MarshalException(f"{what}: {_why_not_encoded(error)}") from error

    def pack_result(self, value: object, what: str) -> bytes:
        """Return what stands for the struct, None, a value or a tuple, as MessagePack.

        Raises MarshalException when it does not fit.
        """
        return bytes(self.gather_result(value, what))

    def gather(self, values: tuple[object, ...], what: str) -> bytes | Pieces:
        """Do as `pack` does, but leave large byte sequences where they are, as pieces."""
        struct: msgspec.Struct = self._make(*values)
        try:
            if not self._byte_sequences:
                return _encoder.encode(struct)
            struct, taken = take_out(struct, self._byte_sequences)
            encoded = _encoder.encode(struct)
        except _ENCODE_ERRORS as error:
            raise MarshalException(f"{what}: {_why_not_encoded(error)}") from error
        return split_off(encoded, taken) if taken else encoded

    def gather_result(self, value: object, what: str) -> bytes | Pieces:
        """Do as `pack_result` does, but leave large byte sequences where they are, as pieces."""
        count = len(self.fields)
        if count == 1:
            if self._byte_sequences:
                return self.gather((value,), what)
            try:  # here: the way through `gather` costs a small call more
                return _encoder.encode(self._make(value))
            except _ENCODE_ERRORS as error:
                raise MarshalException(f"{what}: {_why_not_encoded(error)}") from error
        if count == 0:
            values: tuple[object, ...] = ()
            fits = value is None
        else:
            values = value if isinstance(value, tuple) else ()
            fits = len(values) == count
        if not fits:
            expected = f"a tuple ({', '.join(self.fields)})" if count else "None"
            raise MarshalException(f"{what}: expected {expected}, got {type(value).__name__}")
        return self.gather(values, what)

    def unpack(self, payload: bytes | Parted, what: str, resolve: Resolve | None = None) -> S:
        """Return the struct that a payload holds; proxies in it are made by `resolve`.

        Raises MarshalException with the path of the first field that does not fit.
        """
        if isinstance(payload, Parted):
            struct = self.unpack(payload.rest, what, resolve)
            put_back(struct, self._byte_sequences, payload, what)
            return struct
        try:
            if self._arrival is None:
                return self._decoder.decode(payload)
            return self._arrival.decode(payload, resolve)
        except DECODE_ERRORS as error:
            raise misfit(error, what) from error

    def unpack_result(self, payload: bytes | Parted, what: str, resolve: Resolve | None = None) -> object:
        """Return what stands for the struct that a payload holds: None, a value or a tuple.

        Raises MarshalException with the path of the first field that does not fit.
        """
        return self.value_of(self.unpack(payload, what, resolve))

    def decoder(self, resolve: Resolve | None) -> Callable[[bytes], S]:
        """Return what does as `unpack`, and raises DECODE_ERRORS instead, which `misfit` explains."""
        arrival = self._arrival
        return self._decoder.decode if arrival is None else partial(arrival.decode, resolve=resolve)


def _why_not_encoded(error: BaseException) -> str:
    if isinstance(error, RecursionError):
        return "nested too deeply, or in a cycle: a value that holds itself cannot travel"
    return str(error)


def _nothing(_: object) -> None:
    """Stand for a struct without members."""


def misfit(error: BaseException, what: str) -> MarshalException:
    """Return what tells of one of DECODE_ERRORS, with the path of the first field that does not fit."""
    message, path = _explain(error)
    return MarshalException(f"{what}: {message}" + (f" at {path}" if path else ""), path)


def _explain(error: BaseException) -> tuple[str, str]:
    """Return message and path of an error in a payload."""
    if isinstance(error, RecursionError):
        return "nested too deeply", ""
    if isinstance(error, MemoryError):
        return "announces more elements than fit into memory", ""
    message, path = str(error), ""  # it quotes texts of the payload
    if match := _PATH.search(message):
        message, path = message[: match.start()], match[1]
    if path.endswith(f".{TYPE_FIELD}") and message.startswith(_INVALID):
        message = f"no class that fits is known as {message.removeprefix(_INVALID)}"
    if isinstance(error, msgspec.ValidationError) and (match := _MISSING_FIELD.search(message)):
        path = f"{path or '$'}.{match[1]}"
    return printable(message), path or ("$" if isinstance(error, msgspec.ValidationError) else "")


def _holds_bytes(node: object, seen: set[type]) -> bool:
    match node:
        case inspect.BytesType() | inspect.ByteArrayType() | inspect.MemoryViewType():
            return True
        case inspect.StructType(cls=cls, fields=fields):
            if cls in seen:
                return False
            seen.add(cls)
            derived = derived_classes(cls).values() if issubclass(cls, Value) else ()
            return any(_holds_bytes(field.type, seen) for field in fields) or any(
                _holds_bytes(inspect.type_info(each), seen) for each in derived
            )
        case inspect.ListType(item_type=item):
            return _holds_bytes(item, seen)
        case inspect.DictType(key_type=key, value_type=value):
            return _holds_bytes(key, seen) or _holds_bytes(value, seen)
        case inspect.UnionType(types=types):
            return any(_holds_bytes(item, seen) for item in types)
    return False
