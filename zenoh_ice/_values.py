"""What msgspec alone does not decode: classes, which may arrive as what extends them, and proxies, as text.

For each such type there is a wire type that msgspec decodes and checks: one of all known classes in place of
a class, and a struct whose members with default values are required all the same, as a payload of empty maps
must not grow a hundredfold. Values of wire types become those of the interface as they are decoded.
"""

from __future__ import annotations

import itertools
import re
import sys
import threading
import types
from abc import ABC, abstractmethod
from array import array
from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import Annotated, Any, Final, Generic, Self, TypeVar, Union, get_args, get_origin

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

S = TypeVar("S", bound=msgspec.Struct)

_MOST_SLICED: Final = 16  # unknown classes in one payload
_UNKNOWN_CLASS: Final = re.compile(rf"^Invalid value '(::[\w: ]+)' - at `\$.*\.{TYPE_FIELD}`$", re.DOTALL)
_WIRE_MODULE: Final = ""  # no module has this name: what was loaded is told from what was made here by it

# Beside the classes that a union is made of, as msgspec asks for the type field only where there are several.
# It never arrives: no text is longer than 0 and shorter than 1.
_Never: Final = Annotated[str, msgspec.Meta(min_length=1, max_length=0)]
_NoClass: Final = msgspec.defstruct("_NoClass", [("never", _Never)], tag="", tag_field=TYPE_FIELD)

_counter: Final = itertools.count(1)
_classes_made: int = 0  # what was built from all of them is stale when it grew


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
        global _classes_made  # noqa: PLW0603 - the types of a process are global
        if cls.__module__ != _WIRE_MODULE:
            _classes_made = next(_counter)


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


def derived_classes(cls: type[Value]) -> dict[str, type[Value]]:
    """Return a class and every known one that extends it, near or far, by type id.

    A subclass without a type id of its own, made by hand, does not count; nor do classes of modules that were
    unloaded, and of a module that was loaded again those of the last time do.
    """
    found = {type_ids_of(cls)[0]: cls}
    waiting = [cls]
    for each in waiting:  # which grows meanwhile
        for derived in each.__subclasses__():
            waiting.append(derived)
            being_made = derived.__struct_config__.tag is None  # by another thread
            if derived.__module__ in sys.modules and not being_made:
                type_id = type_ids_of(derived)[0]
                if type_id != type_ids_of(each)[0]:
                    found[type_id] = derived
    return found


def type_ids_of(cls: type[Value]) -> list[str]:
    """Return the type ids of a class and of those that it extends, the nearest first."""
    return str(cls.__struct_config__.tag).split()


def arrives_as_it_is(struct: type[msgspec.Struct]) -> bool:
    """Return whether msgspec alone can decode a struct."""
    made = _WireTypes(())
    return made.of(struct) is struct and not made.has_references


class _Here(threading.local):
    resolve: Resolve | None = None
    """Makes the proxies of the payload that this thread decodes."""


_here: Final = _Here()


class Arrival(Generic[S]):
    """Decode payloads of one struct for which msgspec alone is not enough."""

    def __init__(self, struct: type[S]) -> None:
        self._struct: Final = struct
        self._built = self._build(())

    def decode(self, payload: bytes, resolve: Resolve | None) -> S:
        """Return the struct that a payload holds, its proxies made by a function.

        Raises what msgspec raises, and MarshalException for a proxy without one.
        """
        _here.resolve = resolve
        try:
            for _ in range(_MOST_SLICED):
                made, sliced, decoder = self._built  # at once: other threads decode, too
                if made != _classes_made:
                    _, sliced, decoder = self._built = self._build(())
                try:
                    return decoder.decode(payload)
                except msgspec.ValidationError as error:
                    unknown = _UNKNOWN_CLASS.match(str(error))
                    if unknown is None or unknown[1] in sliced:
                        raise
                    self._built = self._build((*sliced[1 - _MOST_SLICED :], unknown[1]))
            return self._built[2].decode(payload)
        finally:
            _here.resolve = None

    def _build(self, sliced: tuple[str, ...]) -> tuple[int, tuple[str, ...], msgspec.msgpack.Decoder[S]]:
        """Return a decoder that takes these unknown classes for known bases, and what it was built from."""
        made = _classes_made
        return made, sliced, msgspec.msgpack.Decoder(_WireTypes(sliced).of(self._struct), dec_hook=_proxy)


def _proxy(kind: type[Reference], text: object) -> Reference:
    """Return the proxy that a text in a payload stands for."""
    if not isinstance(text, str) or not re.match(PROXY_TEXT, text):
        raise ValueError(f"Expected a proxy, got {text!r}")  # msgspec adds where
    if _here.resolve is None:
        raise MarshalException(f"the proxy {text} needs a communicator to arrive")
    return kind.ice_fromWire(text, _here.resolve)


class _WireTypes:
    """The wire types of a type and of all that it is made of."""

    def __init__(self, sliced: tuple[str, ...]) -> None:
        self.has_references = False
        self._sliced: Final = sliced
        self._structs: dict[type, type[msgspec.Struct]] = {}
        self._classes: dict[str, type[msgspec.Struct]] = {}
        self._waiting: list[tuple[type[Value], type[msgspec.Struct]]] = []

    def of(self, kind: Any) -> Any:  # noqa: ANN401 - a type or what stands for one in annotations
        """Return the wire type of a type: itself where msgspec alone can decode it."""
        wire_type = self._of(kind)
        while self._waiting:  # classes refer to each other: their members come when all classes are there
            cls, wire = self._waiting.pop()
            wire.__annotations__.update(self._members(cls))
        return wire_type

    def _of(self, kind: Any) -> Any:  # noqa: ANN401 - as above
        origin, arguments = get_origin(kind), get_args(kind)
        if origin is Union or origin is types.UnionType:
            return reduce(or_, map(self._of, arguments))
        if origin in {list, dict}:
            return origin[tuple(map(self._of, arguments))]
        if not isinstance(kind, type):
            return kind
        if issubclass(kind, Value):
            return self._class(kind)
        self.has_references |= issubclass(kind, Reference)
        return self._struct(kind) if issubclass(kind, msgspec.Struct) else kind

    def _struct(self, cls: type[msgspec.Struct]) -> type[msgspec.Struct]:
        if cls not in self._structs:
            self._structs[cls] = cls  # in itself, as Slice has it of classes alone
            members = self._members(cls)
            if any(
                members[field.name] != field.type or not (field.required or _optional(field))
                for field in msgspec.structs.fields(cls)
            ):
                self._structs[cls] = _wire_struct(cls, members)
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
            members = dict.fromkeys(cls.__struct_fields__, object)
            self._classes[tag] = _wire_struct(cls, members, tag=tag)
            self._waiting.append((cls, self._classes[tag]))
        return self._classes[tag]

    def _members(self, cls: type[msgspec.Struct]) -> dict[str, Any]:
        return {field.name: self._of(field.type) for field in msgspec.structs.fields(cls)}


def _optional(field: msgspec.structs.FieldInfo) -> bool:
    """Return whether a member may be absent: others that have a default value are required on the wire."""
    return not field.required and type(None) in get_args(field.type)


def _wire_struct(cls: type[msgspec.Struct], members: dict[str, Any], **tag: str) -> type[msgspec.Struct]:
    """Return a struct whose members have other types; what is decoded as one becomes one of the given."""

    def become(self: msgspec.Struct) -> None:
        self.__class__ = cls

    fields = msgspec.structs.fields(cls)
    return msgspec.defstruct(
        cls.__name__,
        [(f.name, members[f.name], None) if _optional(f) else (f.name, members[f.name]) for f in fields],
        bases=(cls,),
        namespace={"__post_init__": become},
        module=_WIRE_MODULE,
        rename={field.name: field.encode_name for field in fields},
        kw_only=True,
        **tag,
    )
