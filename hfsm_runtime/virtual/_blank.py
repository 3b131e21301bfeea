"""Blank values of declared types, which stand-ins return: filled at any depth, so that code can read them."""

from __future__ import annotations

import types
from collections.abc import Callable
from enum import EnumType
from typing import Annotated, Any, Final, Union, get_args, get_origin

import msgspec

from zenoh_ice import ObjectPrx

MakeProxy = Callable[[type[ObjectPrx]], ObjectPrx | None]
"""Returns a proxy of a type for a blank value, or None."""

_NESTED: Final = 2
"""Objects of one class within each other; what they refer to beyond that is null."""


def blank(struct: type[msgspec.Struct], proxy: MakeProxy = lambda _: None) -> tuple[object, ...]:
    """Return blank values for the fields of a struct.

    Numbers are zeros, texts and bytes are empty, an enumeration has its first value. Structs, classes and
    optional values are there, with blank members or the defaults that are declared; sequences and
    dictionaries have one blank element. `proxy` makes the proxies.
    """
    make = _Blanks(proxy)
    return tuple(make.value(field.type) for field in msgspec.structs.fields(struct))


class _Blanks:
    """Makes blank values, and keeps track of the classes whose objects are being made."""

    def __init__(self, proxy: MakeProxy) -> None:
        self._proxy: Final = proxy
        self._within: Final[list[type]] = []

    def value(self, kind: Any) -> Any:  # noqa: ANN401 - any type
        """Return the blank value of a type; None for a proxy or an object that is not made."""
        origin, arguments = get_origin(kind), get_args(kind)
        if origin is Annotated:
            return self.value(arguments[0])
        if origin in {Union, types.UnionType}:
            return self.value(next(each for each in arguments if each is not types.NoneType))
        if origin is list:
            element = self.value(arguments[0])
            return [] if element is None else [element]
        if origin is dict:
            key, element = map(self.value, arguments)
            return {} if element is None else {key: element}
        if isinstance(kind, EnumType):
            return next(iter(kind))
        if issubclass(kind, ObjectPrx):
            return self._proxy(kind)
        return self._struct(kind) if issubclass(kind, msgspec.Struct) else kind()

    def _struct(self, kind: type[msgspec.Struct]) -> msgspec.Struct | None:
        if self._within.count(kind) == _NESTED:
            return None
        self._within.append(kind)
        fields = msgspec.structs.fields(kind)
        made = kind(**{field.name: self._member(field) for field in fields})
        self._within.pop()
        return made

    def _member(self, field: msgspec.structs.FieldInfo) -> object:
        declared = field.default
        return declared if isinstance(declared, int | float | str | bytes) else self.value(field.type)
