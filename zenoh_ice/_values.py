"""What travels beside plain structs: classes, which are told apart on the wire, and proxies, as text.

For each type that msgspec alone cannot decode there is a form that it decodes and checks, in which a class is
one of all that are known to extend it, a proxy is its text, and a member with a default value is required all
the same: a payload of empty maps must not grow a hundredfold. What was decoded is then turned into the types
of the interface.
"""

from __future__ import annotations

import itertools
import re
import sys
import types
from abc import ABC, abstractmethod
from array import array
from collections.abc import Callable, Iterable
from functools import reduce
from operator import or_
from typing import (
    Annotated,
    Any,
    Final,
    Generic,
    NamedTuple,
    Self,
    TypeVar,
    Union,
    get_args,
    get_origin,
)

import msgspec

from .exceptions import MarshalException

__all__ = [
    "NAME",
    "PROXY_TEXT",
    "TYPE_FIELD",
    "Arrival",
    "Reference",
    "Resolve",
    "Struct",
    "Value",
    "arrives_as_it_is",
    "classes_made",
    "derived_classes",
    "type_ids_of",
]

NAME: Final = r"[A-Za-z0-9_.\-]{1,128}"
"""Pattern of a realm and of an identity: one chunk of a key, without marks."""

PROXY_TEXT: Final = rf"\A({NAME})(?: -([to]))?(?:@({NAME}))?\Z"
"""Pattern of a proxy as text: identity, mode (twoway or oneway) and realm."""

TYPE_FIELD: Final = "@type"
"""The key, which no member can have, under which a value of a class says of which class it is.

It holds the type ids of the class and of those that it extends, the nearest first, with a space between
them: a receiver that does not know the first takes the value as one of the next.
"""

_counter: Final = itertools.count(1)
_made: int = 0

S = TypeVar("S", bound=msgspec.Struct)

_Convert = Callable[[Any, "Resolve | None"], Any]

_MOST_SLICED: Final = 16  # unknown classes in one payload
_PROXY_TEXT: Final = Annotated[str, msgspec.Meta(pattern=PROXY_TEXT, max_length=300)]
# A type field as MessagePack has it: key, header of the text, type ids.
_TYPE_ENTRY: Final = re.compile(
    rb"\xa5@type(?:[\xa0-\xbf]|\xd9.|\xda..)((?:::\w+)+(?: (?:::\w+)+)*)", re.DOTALL
)
_UNKNOWN_CLASS: Final = re.compile(rf"^Invalid value '.*' - at `\$.*\.{TYPE_FIELD}`$", re.DOTALL)

# Beside the classes that a union is made of, as msgspec asks for the type field only where there are several.
# It never arrives: no text is longer than 0 and shorter than 1.
_Never: Final = Annotated[str, msgspec.Meta(min_length=1, max_length=0)]
_NoClass: Final = msgspec.defstruct("_NoClass", [("never", _Never)], tag="", tag_field=TYPE_FIELD)


class Struct(msgspec.Struct):
    """The root of generated structs: mutable, compared by value.

    A struct whose members all have a hash has one, too, as Slice lets such structs be keys of dictionaries.
    """

    def __hash__(self) -> int:
        # Not that of the tuple, which anybody can foresee: a dictionary whose keys were chosen to collide
        # would take its receiver minutes to fill. Python salts the hashes of bytes.
        return hash(array("q", map(hash, msgspec.structs.astuple(self))).tobytes())


class Value(Struct, tag_field=TYPE_FIELD, tag="::Ice::Object"):
    """The root of generated classes: passed by value, may be null, and arrives as what it was when sent."""

    def __init_subclass__(cls, **options: Any) -> None:  # noqa: ANN401 - those of msgspec
        super().__init_subclass__(**options)
        global _made  # noqa: PLW0603 - the types of a process are global
        _made = next(_counter)


class Reference(ABC):
    """What travels as text and is made again where it arrives: a proxy."""

    @abstractmethod
    def ice_toWire(self) -> str:
        """Return the text that stands for it anywhere."""

    @classmethod
    @abstractmethod
    def ice_fromWire(cls, text: str, resolve: Resolve) -> Self:
        """Return what a text stands for, by a function that makes untyped proxies of texts."""


Resolve = Callable[[str], Reference]
"""Makes an untyped proxy of its text."""


def classes_made() -> int:
    """Return how many classes were made so far: what was built from all of them is stale when it grew."""
    return _made


def derived_classes(cls: type[Value]) -> dict[str, type[Value]]:
    """Return a class and every known one that extends it, near or far, by type id.

    A subclass without a type id of its own, made by hand, does not count; nor do classes of modules that were
    unloaded, and of a module that was loaded again those of the last time do.
    """
    found = {type_ids_of(cls)[0]: cls}
    waiting = list(cls.__subclasses__())
    while waiting:
        derived = waiting.pop(0)
        waiting += derived.__subclasses__()
        being_made = derived.__struct_config__.tag is None  # by another thread
        if derived.__module__ in sys.modules and not being_made:
            type_id = type_ids_of(derived)[0]
            if type_id != type_ids_of(derived.__mro__[1])[0]:
                found[type_id] = derived
    return found


def type_ids_of(cls: type[Value]) -> list[str]:
    """Return the type ids of a class and of those that it extends, the nearest first."""
    return str(cls.__struct_config__.tag).split()


class _Form(NamedTuple):
    """What msgspec decodes, and what turns that into the type of the interface, unless it is that already."""

    wire: Any
    convert: _Convert | None


class _Decoders(NamedTuple):
    """Decoders and conversions for the classes that were known at a time."""

    classes: int
    """How many classes there were."""
    by_sliced: dict[tuple[str, ...], tuple[msgspec.msgpack.Decoder[Any], _Convert]]
    """By the type entries of payloads with unknown classes; for all other payloads by none."""


def arrives_as_it_is(struct: type[msgspec.Struct]) -> bool:
    """Return whether msgspec alone can decode a struct."""
    return _Forms(()).of(struct).convert is None


class Arrival(Generic[S]):
    """Decode payloads of one struct for which msgspec alone is not enough."""

    def __init__(self, struct: type[S]) -> None:
        self._struct: Final = struct
        self._decoders = _Decoders(-1, {})

    def decode(self, payload: bytes, resolve: Resolve | None) -> S:
        """Return the struct that a payload holds, its proxies made by a function.

        Raises what msgspec raises, and MarshalException for a proxy without one.
        """
        decoder, convert = self._decoder(())
        try:
            arrived = decoder.decode(payload)
        except msgspec.ValidationError as error:
            if not _UNKNOWN_CLASS.match(str(error)):
                raise
            decoder, convert = self._decoder(_type_entries(payload))
            arrived = decoder.decode(payload)
        struct: S = convert(arrived, resolve)
        return struct

    def _decoder(self, sliced: tuple[str, ...]) -> tuple[msgspec.msgpack.Decoder[Any], _Convert]:
        """Return decoder and conversion, which take these classes, if they are unknown, for known bases."""
        decoders = self._decoders
        if decoders.classes != classes_made() or len(decoders.by_sliced) > _MOST_SLICED:
            decoders = self._decoders = _Decoders(classes_made(), {})  # at once: other threads decode, too
        known = decoders.by_sliced.get(sliced)
        if known is None:
            form = _Forms(sliced).of(self._struct)
            assert form.convert is not None
            known = decoders.by_sliced[sliced] = msgspec.msgpack.Decoder(form.wire), form.convert
        return known


def _type_entries(payload: bytes) -> tuple[str, ...]:
    """Return what could be the type fields in a payload."""
    found = {match[1].decode("ascii", "replace") for match in _TYPE_ENTRY.finditer(payload)}
    return tuple(sorted(found)[:_MOST_SLICED])


class _Forms:
    """The forms of a type and of all that it is made of."""

    def __init__(self, sliced: Iterable[str]) -> None:
        self._sliced: Final = tuple(sliced)
        self._structs: dict[type, _Form] = {}
        self._classes: dict[str, type[msgspec.Struct]] = {}
        self._waiting: list[tuple[type[Value], type[msgspec.Struct]]] = []
        self._makers: dict[type, _Convert] = {}

    def of(self, kind: Any) -> _Form:  # noqa: ANN401 - a type or what stands for one in annotations
        """Return the form of a type."""
        form = self._of(kind)
        while self._waiting:  # classes refer to each other: their members come when all classes are there
            cls, wire = self._waiting.pop()
            fields = self._fields(cls)
            wire.__annotations__.update({field.name: form.wire for field, form in fields})
            self._makers[wire] = _maker(cls, fields)
        return form

    def _of(self, kind: Any) -> _Form:  # noqa: ANN401 - as above
        origin, arguments = get_origin(kind), get_args(kind)
        if origin is Annotated:
            form = self._of(arguments[0])
            return _Form(kind, None) if form.convert is None else form
        if origin is Union or origin is types.UnionType:
            return self._union(kind, arguments)
        if origin is list:
            return self._list(kind, arguments[0])
        if origin is dict:
            return self._dict(kind, *arguments)
        if isinstance(kind, type):
            if issubclass(kind, Value):
                return _Form(self._class(kind), self._make)
            if issubclass(kind, msgspec.Struct):
                return self._struct(kind)
            if issubclass(kind, Reference):
                return _Form(_PROXY_TEXT, _proxy_of(kind))
        return _Form(kind, None)

    def _union(self, kind: Any, arguments: tuple[Any, ...]) -> _Form:  # noqa: ANN401 - as above
        forms = [self._of(argument) for argument in arguments]
        # Of what codegen writes, at most one part of a union is not None.
        convert = next((form.convert for form in forms if form.convert is not None), None)
        if convert is None:
            return _Form(kind, None)
        some: _Convert = convert
        return _Form(
            reduce(or_, [form.wire for form in forms]),
            lambda value, resolve: None if value is None else some(value, resolve),
        )

    def _list(self, kind: Any, element: Any) -> _Form:  # noqa: ANN401 - as above
        wire, convert = self._of(element)
        if convert is None:
            return _Form(kind, None)
        return _Form(
            list[wire],  # type: ignore[valid-type]
            lambda value, resolve: [convert(item, resolve) for item in value],
        )

    def _dict(self, kind: Any, key: Any, value: Any) -> _Form:  # noqa: ANN401 - as above
        keys, values = self._of(key), self._of(value)
        if keys.convert is None and values.convert is None:
            return _Form(kind, None)
        convert_key, convert_value = keys.convert or _same, values.convert or _same
        return _Form(
            dict[keys.wire, values.wire],  # type: ignore[name-defined]
            lambda items, resolve: {
                convert_key(key, resolve): convert_value(item, resolve) for key, item in items.items()
            },
        )

    def _struct(self, cls: type[msgspec.Struct]) -> _Form:
        if cls not in self._structs:
            self._structs[cls] = _Form(cls, None)  # in itself, as Slice has it of classes alone
            fields = self._fields(cls)
            if not all(
                form.convert is None and (field.required or _optional(field)) for field, form in fields
            ):
                wire = _wire_struct(cls, {field.name: form.wire for field, form in fields})
                self._structs[cls] = _Form(wire, _maker(cls, fields))
        return self._structs[cls]

    def _class(self, cls: type[Value]) -> Any:  # noqa: ANN401 - a union
        """Return one of all known classes that extend a class, or it itself."""
        by_id = derived_classes(cls)
        found = {str(derived.__struct_config__.tag): derived for derived in by_id.values()}
        for type_ids in self._sliced:
            nearest = next((by_id[base] for base in type_ids.split() if base in by_id), None)
            if nearest is not None:
                found.setdefault(type_ids, nearest)
        return reduce(or_, [self._wire_class(each, tag) for tag, each in found.items()], _NoClass)

    def _wire_class(self, cls: type[Value], tag: str) -> type[msgspec.Struct]:
        if tag not in self._classes:
            wire = _wire_struct(cls, {}, tag=tag, tag_field=TYPE_FIELD)
            self._classes[tag] = wire
            self._waiting.append((cls, wire))
        return self._classes[tag]

    def _make(self, arrived: Any, resolve: Resolve | None) -> Any:  # noqa: ANN401 - of any class
        return self._makers[type(arrived)](arrived, resolve)

    def _fields(self, cls: type[msgspec.Struct]) -> list[tuple[msgspec.structs.FieldInfo, _Form]]:
        return [(field, self._of(field.type)) for field in msgspec.structs.fields(cls)]


def _optional(field: msgspec.structs.FieldInfo) -> bool:
    """Return whether a member may be absent: others that have a default value are required on the wire."""
    return not field.required and type(None) in get_args(field.type)


def _wire_struct(
    cls: type[msgspec.Struct],
    types_: dict[str, Any],
    **tag: Any,  # noqa: ANN401 - for msgspec
) -> type[msgspec.Struct]:
    """Return a struct of the same members, of other types if they are given."""
    members: list[Any] = []
    for field in msgspec.structs.fields(cls):
        member = (field.name, types_.get(field.name, object))
        members.append((*member, None) if _optional(field) else member)
    rename = {field.name: field.encode_name for field in msgspec.structs.fields(cls)}
    return msgspec.defstruct(cls.__name__, members, bases=(Struct,), rename=rename, kw_only=True, **tag)


def _maker(cls: type[msgspec.Struct], fields: list[tuple[msgspec.structs.FieldInfo, _Form]]) -> _Convert:
    """Return what makes a struct from its wire form."""
    plan = [(field.name, form.convert) for field, form in fields]

    def make(arrived: Any, resolve: Resolve | None) -> msgspec.Struct:  # noqa: ANN401
        members = {}
        for name, convert in plan:
            member = getattr(arrived, name)
            members[name] = member if convert is None else convert(member, resolve)
        return cls(**members)

    return make


def _proxy_of(kind: type[Reference]) -> _Convert:
    def convert(text: str, resolve: Resolve | None) -> Reference:
        if resolve is None:
            raise MarshalException(f"the proxy {text} needs a communicator to arrive")
        return kind.ice_fromWire(text, resolve)

    return convert


def _same(value: Any, _: Resolve | None) -> Any:  # noqa: ANN401 - whatever it is
    return value
