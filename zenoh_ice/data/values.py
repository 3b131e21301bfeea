"""Types that msgspec alone does not decode: classes, which may arrive as subclasses, and proxies, as text.

For each such type there is a wire type that msgspec decodes and checks; that of a class is a union of all
known classes that extend it. Values of wire types become values of the interface when they are decoded.

Members have default values in Python, as in Ice's mapping, but are required on the wire: a payload of empty
maps must not grow a hundredfold.
"""

from __future__ import annotations

import sys
import types
from abc import ABC, abstractmethod
from array import array
from collections.abc import Callable
from copy import deepcopy
from functools import lru_cache, partial, reduce
from operator import or_
from typing import Annotated, Any, ClassVar, Final, Self, Union, cast, get_args, get_origin

import msgspec

NAME: Final = r"[A-Za-z0-9_.\-]{1,128}"
"""Pattern of a realm and of an identity: one chunk of a key, without marks."""

PROXY_TEXT: Final = rf"\A({NAME})(?:@({NAME}))?\Z"
"""Pattern of a proxy as text: identity and realm."""

TYPE_FIELD: Final = "@type"
"""The key, which no member can have, under which a value of a class has the type id of its class."""

_WIRE_MODULE: Final = ""  # no module has this name: it marks the classes that are made here

# An extra member of each union of classes: msgspec requires the type field only if there are several.
# It never arrives, because no text has at least one character and at most none.
_Never: Final = Annotated[str, msgspec.Meta(min_length=1, max_length=0)]
_NoClass: Final = msgspec.defstruct("_NoClass", [("never", _Never)], tag="", tag_field=TYPE_FIELD)

fields_of: Final = lru_cache(maxsize=1024)(msgspec.structs.fields)  # msgspec looks them up again each time

NULL: Final[Any] = object()
"""The default value of a member that is None if not given, but required on the wire."""


def slice_name(name: str) -> str:
    """Return the Slice name for a Python name: names that Python reserves begin with `_` there."""
    return name[1:] if name[:1] == "_" else name


class StructType(msgspec.StructMeta):
    """Makes structs whose default values may be mutable: each struct gets its own copy."""

    known: ClassVar[object] = object()
    """A different object after each new struct: anything built from all known classes is then stale."""

    def __new__(
        cls,
        name: str,
        bases: tuple[type, ...],
        namespace: dict[str, Any],
        **options: Any,  # noqa: ANN401
    ) -> StructType:
        """Make a struct, with a factory for each default value that is mutable."""
        for member in namespace.get("__annotations__", {}):
            value = namespace.get(member)
            if value is NULL or isinstance(value, list | dict | set | msgspec.Struct):
                make = partial(deepcopy, None if value is NULL else value)
                namespace[member] = msgspec.field(default_factory=make)
        made: StructType = super().__new__(cls, name, bases, namespace, **options)
        if made.__module__ != _WIRE_MODULE:
            StructType.known = object()
        return made


class Struct(msgspec.Struct, metaclass=StructType, rename=slice_name):
    """The root of generated structs: mutable, compared by value.

    A struct whose members all have a hash has one, too, as Slice lets such structs be keys of dictionaries.
    """

    def __hash__(self) -> int:
        # Not the hash of the tuple, which is predictable: a dictionary with keys chosen to collide would take
        # its receiver minutes to fill. Python salts the hashes of bytes.
        return hash(array("q", map(hash, msgspec.structs.astuple(self))).tobytes())


class Value(Struct, tag_field=TYPE_FIELD, tag="::Ice::Object"):
    """The root of generated classes: passed by value, may be null, and arrives as what it was when sent."""


class Reference(ABC):
    """An object that is encoded as text and made again by the receiver: a proxy."""

    @abstractmethod
    def ice_toWire(self) -> str:
        """Return the text that represents it in every realm."""

    @classmethod
    @abstractmethod
    def uncheckedCast(cls, proxy: Any) -> Self:  # noqa: ANN401 - what `Resolve` returns
        """Return an untyped proxy as one of this type."""


Resolve = Callable[[str], Reference]
"""Makes an untyped proxy from its text."""


@lru_cache(maxsize=64)  # wire types are subclasses, too: a flood of unknown classes must not make this slow
def derived_classes(cls: type[Value], known: object) -> dict[str, type[Value]]:  # noqa: ARG001
    """Return a class and every one that extends it, near or far, by type id.

    `known` is a different value whenever there may be other classes. Handwritten classes without their own
    type id do not count; nor do classes of modules that were unloaded, or reloaded since.
    """
    found = {type_id_of(cls): cls}
    waiting = [cls]
    for each in waiting:  # grows during the loop
        for derived in each.__subclasses__():
            waiting.append(derived)
            tag = derived.__struct_config__.tag  # None while another thread makes the class
            if tag not in {None, each.__struct_config__.tag} and _is_loaded(derived):
                found[type_id_of(derived)] = derived
    return found


def _is_loaded(cls: type[Value]) -> bool:
    """Return whether the module of a class is loaded: before and after, its members' types are missing.

    They may also be missing in a package that is being imported by another thread.
    """
    try:
        msgspec.structs.fields(cls)
    except (NameError, AttributeError):
        return False
    return cls.__module__ in sys.modules


def type_id_of(cls: type[Value]) -> str:
    """Return the type id of a class."""
    return str(cls.__struct_config__.tag)


class WireTypes:
    """The wire types of a struct and of everything in it."""

    def __init__(self, struct: type[msgspec.Struct]) -> None:
        self._structs: dict[type, type[msgspec.Struct]] = {}
        self._classes: dict[type[Value], type[msgspec.Struct]] = {}
        self._waiting: list[tuple[type[Value], type[msgspec.Struct]]] = []
        self.leaves: Final[set[type]] = set()
        """Types in it, at any depth, that are neither structs nor classes nor composed of other types."""
        self.root: Final = self._struct(struct)
        while self._waiting:  # classes refer to each other: their members are set once all classes exist
            cls, wire = self._waiting.pop()
            wire.__annotations__.update(self._members(cls))
        self.plain: Final = not self._classes and not any(issubclass(leaf, Reference) for leaf in self.leaves)
        """Whether it has neither classes nor proxies."""

    def _of(self, kind: Any) -> Any:  # noqa: ANN401 - a type or what stands for one in annotations
        origin = get_origin(kind)
        if origin in {Union, types.UnionType, list, dict}:
            generic = Union if origin is types.UnionType else origin
            return generic[tuple(map(self._of, get_args(kind)))]
        if not isinstance(kind, type):
            return kind
        if issubclass(kind, Value):
            return self._class(kind)
        if issubclass(kind, msgspec.Struct):
            return self._struct(kind)
        self.leaves.add(kind)
        return kind

    def _struct(self, cls: type[msgspec.Struct]) -> type[msgspec.Struct]:
        if cls not in self._structs:
            self._structs[cls] = cls  # in itself, as Slice has it of classes alone
            members, fields = self._members(cls), fields_of(cls)
            if any(members[f.name] != f.type or not (f.required or f.default is None) for f in fields):
                self._structs[cls] = wire = _wire_struct(cls)
                wire.__annotations__.update(members)
        return self._structs[cls]

    def _class(self, cls: type[Value]) -> Any:  # noqa: ANN401 - a union
        """Return the union of a class and all known classes that extend it."""
        found = derived_classes(cls, (StructType.known, *sys.modules))
        return reduce(or_, map(self._wire_class, found.values()), _NoClass)

    def _wire_class(self, cls: type[Value]) -> type[msgspec.Struct]:
        if cls not in self._classes:
            self._classes[cls] = wire = _wire_struct(cls)
            self._waiting.append((cls, wire))
        return self._classes[cls]

    def _members(self, cls: type[msgspec.Struct]) -> dict[str, Any]:
        return {field.name: self._of(field.type) for field in fields_of(cls)}


def _wire_struct(cls: type[msgspec.Struct]) -> type[msgspec.Struct]:
    """Return a struct of the same members, whose types the caller sets; what it decodes becomes a `cls`."""

    def become(self: msgspec.Struct) -> None:
        self.__class__ = cls

    fields = fields_of(cls)
    namespace = {
        "__annotations__": dict.fromkeys(cls.__struct_fields__),
        "__module__": _WIRE_MODULE,
        "__post_init__": become,
        **{field.name: None for field in fields if field.default is None},  # they may be absent
    }
    made = StructType(cls.__name__, (cls,), namespace, kw_only=True)
    return cast("type[msgspec.Struct]", made)
