"""The roots of what travels: structs, classes, which are told apart on the wire, and proxies, as text."""

from __future__ import annotations

import itertools
import sys
from abc import ABC, abstractmethod
from array import array
from collections.abc import Callable
from typing import Any, Final, Self

import msgspec

__all__ = [
    "TYPE_FIELD",
    "Reference",
    "Resolve",
    "Struct",
    "Value",
    "classes_made",
    "derived_classes",
    "type_ids_of",
]

TYPE_FIELD: Final = "@type"
"""The key, which no member can have, under which a value of a class says of which class it is.

It holds the type ids of the class and of those that it extends, the nearest first, with a space between
them: a receiver that does not know the first takes the value as one of the next.
"""

_counter: Final = itertools.count(1)
_made: int = 0


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
    """What travels as text and is made anew where it arrives: a proxy."""

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
