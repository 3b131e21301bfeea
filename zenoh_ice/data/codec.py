"""Turn structs into MessagePack and back, checking everything that comes from outside.

Large byte sequences are copied neither into a payload that is sent nor out of one that was received.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from contextvars import ContextVar
from functools import lru_cache, reduce
from operator import attrgetter
from typing import Any, Final, Generic, NamedTuple, Protocol, TypeVar

import msgspec

from zenoh_ice.data import typed
from zenoh_ice.data.exceptions import MarshalException
from zenoh_ice.data.text import printable, sentence
from zenoh_ice.data.values import (
    PROXY_TEXT,
    TYPE_FIELD,
    Reference,
    Resolve,
    StructType,
    Value,
    WireTypes,
    fields_of,
)

LARGE: Final = 1 << 16  # size in bytes from which a byte sequence becomes a separate piece
LARGEST_PAYLOAD: Final = 1 << 20  # bytes of a payload that is decoded
LARGEST_BULK: Final = 32 << 20  # the same, if its type holds byte sequences: images

DECODE_ERRORS: Final = (TypeError, ValueError, OverflowError, RecursionError, MemoryError)
"""Exceptions of msgspec for payloads that it cannot decode, and TypeError for such types of a schema."""

ENCODE_ERRORS: Final = (TypeError, ValueError, OverflowError, RecursionError, BufferError)
"""Exceptions of `to_msgpack` for values that cannot be encoded; `not_encoded` explains them."""
_APART: Final = range(
    LARGE, 1 << 32
)  # sizes of byte sequences that travel apart; MessagePack has no longer ones
_HEADER_SIZE: Final = 5  # of a large byte sequence there: a type byte and the length
_EMPTY: Final = b"\xc4\x00"  # a byte sequence of none

# Placeholder for bytes taken out of the encoding. It is secret, so it occurs nowhere else in there.
_MARK: Final = os.urandom(16)
_ENCODED_MARK: Final = msgspec.msgpack.encode(_MARK)

_PATH: Final = re.compile(r" - at `(?:key in )?(\$[^`]*)`$")
_MISSING_FIELD: Final = re.compile(r"missing required field `([^`]+)`")
_WRONG_TYPE: Final = re.compile(r"Expected `(bool|int|float|str)`, got `(\w+)`")
_PLACE: Final = re.compile(r"\$\.([\w.\[\]]+)")
_PYTHON: Final = {"null": "None", "array": "list"}
"""What Python calls a type of MessagePack."""
_MOST_SEQUENCES: Final = 256  # byte sequences in a struct that may travel apart

S = TypeVar("S", bound=msgspec.Struct)
V = TypeVar("V")

_resolve: ContextVar[Resolve | None] = ContextVar("_resolve")  # makes proxies of what this thread decodes


class Buffer(Protocol):
    """Bytes that arrived; their size is known before they are copied."""

    def __len__(self) -> int: ...

    def __bytes__(self) -> bytes: ...


class Parted(NamedTuple):
    """A payload with empty byte sequences in place of the large ones, and the large ones separately."""

    rest: bytes
    places: tuple[int, ...]
    """The index of each large byte sequence among all of the payload's type."""
    large: Sequence[bytes]


class Pieces(msgspec.Struct, eq=False):
    """A payload not yet joined into one buffer: small parts with a large byte sequence between each two."""

    small: Sequence[bytes]
    large: Sequence[bytes]
    places: tuple[int, ...]

    def __len__(self) -> int:
        return sum(map(len, self.small)) + sum(_HEADER_SIZE + len(each) for each in self.large)

    def __bytes__(self) -> bytes:
        parts = [self.small[0]]
        for place, large in enumerate(self.large, start=1):
            parts += (b"\xc6" + len(large).to_bytes(4), large, self.small[place])
        return b"".join(parts)

    def without_large(self) -> bytes:
        """Return the payload with empty byte sequences in place of the large ones."""
        return _EMPTY.join(self.small)


@lru_cache(maxsize=512)
def byte_sequences(struct: type[msgspec.Struct]) -> tuple[tuple[str, ...], ...]:
    """Return the path to each byte sequence in a struct, as names of members."""
    found: list[tuple[str, ...]] = []
    for field in fields_of(struct):
        kind = field.type
        if kind is bytes:
            found.append((field.name,))
        elif isinstance(kind, type) and issubclass(kind, msgspec.Struct) and not issubclass(kind, Value):
            found += ((field.name, *rest) for rest in byte_sequences(kind))
    return tuple(found[:_MOST_SEQUENCES])


def _marked(struct: Any, path: tuple[str, ...], place: int, taken: dict[int, bytes], apart: range) -> Any:  # noqa: ANN401
    """Return a copy of a struct with a mark for the bytes at the end of a path, if they travel apart."""
    if not isinstance(struct, msgspec.Struct):  # the receiver refuses it
        return struct
    name, *rest = path
    value = changed = getattr(struct, name, None)
    if rest:
        changed = _marked(value, tuple(rest), place, taken, apart)
    elif isinstance(value, bytes) and len(value) in apart:
        taken[place], changed = value, _MARK
    return struct if changed is value else msgspec.structs.replace(struct, **{name: changed})


def _encode_foreign(value: object) -> object:
    """Return an encodable substitute for a proxy, or for an array or scalar of numpy and the like."""
    if isinstance(value, Reference):
        return value.ice_toWire()
    with suppress(TypeError):
        view = memoryview(value)  # type: ignore[arg-type]
        if view.format == "B" and view.ndim > 0:
            return view if view.c_contiguous else view.tobytes()
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} cannot be encoded")


to_msgpack: Final = msgspec.msgpack.Encoder(enc_hook=_encode_foreign).encode


def encode(value: object, what: str) -> bytes:
    """Return a value as MessagePack; raises MarshalException that begins with `what` if it cannot."""
    try:
        return to_msgpack(value)
    except ENCODE_ERRORS as error:
        raise not_encoded(error, what) from error


def not_encoded(error: BaseException, what: str) -> MarshalException:
    """Return the exception that reports one of ENCODE_ERRORS."""
    endless = "nested too deeply, or in a cycle: a value that holds itself cannot be encoded"
    return MarshalException(f"{what}: {endless if isinstance(error, RecursionError) else error}")


class Codec(Generic[S]):
    """Encode and decode one struct, by parameter name, and convert it from and to its plain Python value.

    The plain value is None for no field, the field's value for one field, and a tuple for several.
    """

    def __init__(self, struct: type[S], apart: range = _APART) -> None:
        self.struct = struct
        self._apart = apart
        self.fields: tuple[str, ...] = struct.__struct_fields__
        self.byte_sequences = byte_sequences(struct)
        by_position = len(struct.__match_args__) == len(self.fields)
        self.make: Callable[..., S] = struct if by_position else self._make_by_name
        """Makes the struct from its field values."""
        single = len(self.fields) == 1 and not self.byte_sequences
        self.make_single: Callable[[object], S] | None = self.make if single else None
        """Makes the struct from its only field's value; None if it has more fields, or byte sequences."""
        self.value_of: Callable[[S], object] = attrgetter(*self.fields) if self.fields else lambda _: None
        """Returns the plain value of a struct: None, a value or a tuple."""
        known, wire = StructType.known, WireTypes(struct)  # in this order: other threads make classes, too
        self._decoder: tuple[object, Callable[[bytes], S]] = known, _decoder(wire)
        """The state of the known classes, and the decoder for them."""
        self.decode: Callable[[bytes], S] | None = self._decoder[1] if wire.plain else None
        """The equivalent of `unpack` in C; it raises DECODE_ERRORS, which `misfit` explains.

        None if the type contains classes or proxies.
        """
        self.holds_bytes = bytes in wire.leaves
        """The type contains a byte sequence, at any depth."""
        self.size_limit = LARGEST_BULK if self.holds_bytes else LARGEST_PAYLOAD
        """Maximum size of a payload in bytes."""

    def _make_by_name(self, *values: object, **named: object) -> S:
        if len(values) > len(self.fields):
            raise TypeError(f"{len(values)} values; {len(self.fields)} are expected")
        return self.struct(**{self.fields[place]: value for place, value in enumerate(values)}, **named)

    def gather_result(self, value: object, what: str) -> bytes | Pieces:
        """Return the plain value of the struct (None, a value or a tuple) as MessagePack.

        Large byte sequences are not copied, but become pieces. Raises MarshalException for a wrong value.
        """
        values = value
        if len(self.fields) == 1:
            values = (value,)
        elif value is None:
            values = ()
        if not isinstance(values, tuple) or len(values) != len(self.fields):
            expected = f"a tuple ({', '.join(self.fields)})" if self.fields else "None"
            raise MarshalException(f"{what}: expected {expected}, got {type(value).__name__}")
        struct = self.make(*values)
        if not self.byte_sequences:
            return encode(struct, what)
        taken: dict[int, bytes] = {}
        for place, path in enumerate(self.byte_sequences):
            struct = _marked(struct, path, place, taken, self._apart)
        encoded = encode(struct, what)
        return Pieces(encoded.split(_ENCODED_MARK), list(taken.values()), tuple(taken)) if taken else encoded

    def unpack(self, payload: bytes | Parted, what: str, resolve: Resolve | None = None) -> S:
        """Return the struct that a payload holds; proxies in it are made by `resolve`.

        Raises MarshalException with the path of the first field that does not fit.
        """
        if isinstance(payload, Parted):
            struct = self.unpack(payload.rest, what, resolve)
            for place, large in zip(payload.places, payload.large, strict=True):
                if not 0 <= place < len(self.byte_sequences):
                    raise MarshalException(f"{what}: large bytes where there are none")
                *way, name = self.byte_sequences[place]
                setattr(reduce(getattr, way, struct), name, large)
            return struct
        try:
            return self.decode(payload) if self.decode is not None else self._decode(payload, resolve)
        except DECODE_ERRORS as error:
            raise misfit(error, what) from error

    def unpack_result(self, payload: bytes | Parted, what: str, resolve: Resolve | None = None) -> object:
        """Return the plain value of the struct that `unpack` returns: None, a value or a tuple."""
        return self.value_of(self.unpack(payload, what, resolve))

    def _decode(self, payload: bytes, resolve: Resolve | None) -> S:
        known, decode = self._decoder
        if known is not StructType.known:
            known = StructType.known  # first, as above
            decode = _decoder(WireTypes(self.struct))
            self._decoder = known, decode
        token = _resolve.set(resolve)
        try:
            return decode(payload)
        finally:
            _resolve.reset(token)


def _decoder(wire: WireTypes) -> Callable[[bytes], Any]:
    return typed.msgpack_decoder(wire.root, dec_hook=_proxy)


def too_large(size: int, limit: int, what: str) -> MarshalException:
    """Return the exception for more bytes than are accepted."""
    return MarshalException(f"{what}: {size} bytes; at most {limit} are accepted")


def decode_bounded(decode: Callable[[bytes], V], data: Buffer, limit: int, what: str) -> V:
    """Decode bytes from outside; raises MarshalException if they are too many or do not fit."""
    if len(data) > limit:  # before they are even copied
        raise too_large(len(data), limit, what)
    try:
        return decode(bytes(data))
    except DECODE_ERRORS as error:
        raise misfit(error, what) from error


def _proxy(kind: type[Reference], text: object) -> Reference:
    """Return the proxy that a text in a payload represents."""
    if not isinstance(text, str) or not re.match(PROXY_TEXT, text):
        raise ValueError(f"Expected a proxy, got {text!r}")  # msgspec adds where
    if (resolve := _resolve.get()) is None:
        raise MarshalException(f"the proxy {text} needs a communicator to arrive")
    return kind.uncheckedCast(resolve(text))


def misfit(error: BaseException, what: str) -> MarshalException:
    """Return the exception for one of DECODE_ERRORS, with the path of the first field that does not fit."""
    if isinstance(error, RecursionError):
        return MarshalException(f"{what}: nested too deeply")
    if isinstance(error, MemoryError):
        return MarshalException(f"{what}: announces more elements than fit into memory")
    message, path = str(error), ""  # the message quotes texts of the payload
    if isinstance(error, msgspec.ValidationError):
        path = "$"
        if match := _PATH.search(message):
            message, path = message[: match.start()], match[1]
        if path.endswith(f".{TYPE_FIELD}"):
            message = re.sub("^Invalid value", "no class that fits is known as", message)
        if match := _MISSING_FIELD.search(message):
            path = f"{path}.{match[1]}"
        if (match := _WRONG_TYPE.fullmatch(message)) and (place := _PLACE.fullmatch(path)):
            name, wanted, given = place[1], match[1], _PYTHON.get(match[2], match[2])
            return MarshalException(f"{what}: {sentence(f'{name} is {wanted}, not {given}')}", path)
    return MarshalException(f"{what}: {printable(message)}" + (f" at {path}" if path else ""), path)
