"""Random values of generated types, and their form in msgpack without our types."""

from __future__ import annotations

import types
from enum import IntEnum
from functools import cache
from typing import Annotated, Any, Union, get_args, get_origin

import msgpack
import msgspec
from hypothesis import strategies as st

from tests.support.any_text import any_text
from zenoh_ice import ObjectPrx
from zenoh_ice.data.codec import Codec, encode
from zenoh_ice.data.keys import Target
from zenoh_ice.data.values import TYPE_FIELD, Value, derived_classes

TOGETHER = 10
"""How many structs a property is tried with at once: for each alone, Hypothesis takes three times as long."""
_NAMES = ("Head", "Body@nao", "LeftArm.Motors@other-realm")


class Desk:
    """Replaces a communicator where proxies only arrive and are not called."""

    realm = "nao"

    def stringToProxy(self, text: str) -> ObjectPrx:
        identity, _, realm = text.partition("@")
        return ObjectPrx(self, Target(realm or self.realm, identity), 1.0)  # type: ignore[arg-type]


class Pairs(tuple[tuple[Any, Any], ...]):
    """A map of MessagePack whose keys may be maps."""

    __slots__ = ()


def values(kind: Any, desk: Desk, depth: int = 3) -> st.SearchStrategy[Any]:
    """Return a strategy of values of an annotated type; classes are nested down to a depth."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        limits = arguments[1]
        return st.integers(limits.ge, limits.le)
    if origin is Union or origin is types.UnionType:
        some = next(argument for argument in arguments if argument is not type(None))
        if depth <= 0 and isinstance(some, type) and issubclass(some, Value):
            return st.none()
        return st.none() | values(some, desk, depth)
    if origin is list:
        return st.lists(values(arguments[0], desk, depth), max_size=3)
    if origin is dict:
        key, item = (values(argument, desk, depth) for argument in arguments)
        return st.dictionaries(key, item, max_size=3)
    if issubclass(kind, Value):
        return st.one_of(
            [struct_values(each, desk, depth - 1) for each in derived_classes(kind, object()).values()]
        )
    if issubclass(kind, msgspec.Struct):
        return struct_values(kind, desk, depth)
    if issubclass(kind, ObjectPrx):
        return st.sampled_from(_NAMES).map(lambda text: kind.uncheckedCast(desk.stringToProxy(text)))
    if issubclass(kind, IntEnum):
        return st.sampled_from(list(kind))
    return {
        bool: st.booleans(),
        float: st.floats(allow_nan=False),
        str: any_text(max_size=5),
        bytes: st.binary(max_size=5),
    }[kind]


@cache
def struct_values(struct: type[msgspec.Struct], desk: Desk, depth: int = 3) -> st.SearchStrategy[Any]:
    """Return a strategy of values of a struct."""
    members = {field.name: values(field.type, desk, depth) for field in msgspec.structs.fields(struct)}
    return st.builds(struct, **members)


@cache
def _names(struct: type[msgspec.Struct]) -> tuple[tuple[str, str], ...]:
    """Return the names of the members of a struct, and those in msgpack."""
    return tuple((field.name, field.encode_name) for field in msgspec.structs.fields(struct))


def plain(value: Any) -> Any:
    """Return a value as in a dynamic language without our types."""
    if isinstance(value, msgspec.Struct):
        members = [(sent, plain(getattr(value, name))) for name, sent in _names(type(value))]
        kind = [(TYPE_FIELD, value.__struct_config__.tag)] if isinstance(value, Value) else []
        return Pairs([*kind, *members])
    if isinstance(value, ObjectPrx):
        return f"{value.ice_getIdentity()}@{value.ice_getRealm()}"
    if isinstance(value, IntEnum):
        return int(value)
    if isinstance(value, list):
        return tuple(plain(item) for item in value)
    if isinstance(value, dict):
        return Pairs((plain(key), plain(item)) for key, item in value.items())
    return value


def pack(codec: Codec[Any], values: tuple[object, ...], what: str = "it") -> bytes:
    """Return a codec's struct of these values as it is sent."""
    return encode(codec.make(*values), what)


def unpacked(payload: bytes) -> Any:
    """Return a payload decoded by msgpack."""
    return msgpack.unpackb(payload, strict_map_key=False, object_pairs_hook=Pairs, use_list=False)


def packed(value: Any) -> bytes:
    """Return a plain value encoded by msgpack."""
    packer = msgpack.Packer()
    if isinstance(value, Pairs):
        return bytes(packer.pack_map_header(len(value))) + b"".join(packed(x) for pair in value for x in pair)
    if isinstance(value, tuple):
        return bytes(packer.pack_array_header(len(value))) + b"".join(map(packed, value))
    return bytes(packer.pack(value))
