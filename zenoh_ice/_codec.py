"""Turn structs into MessagePack and back, checking everything that comes from outside."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cached_property, partial
from operator import attrgetter
from typing import Final, Generic, TypeVar

import msgspec
from msgspec import inspect

from ._arrival import Arrival, arrives_as_it_is
from ._pieces import Parted, Pieces, byte_sequences, put_back, split_off, take_out
from ._values import TYPE_FIELD, Reference, Resolve, Value, derived_classes
from .exceptions import MarshalException
from .text import printable

__all__ = ["DECODE_ERRORS", "Codec", "encode", "misfit"]

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
