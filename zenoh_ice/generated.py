"""What generated code imports; nobody else needs this module."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from .exceptions import UserException
from .object import Current, Object
from .operation import Interface, Operation
from .proxy import ObjectPrx
from .publisher import Publisher
from .stream import streamed

__all__ = [
    "Byte",
    "Current",
    "Int",
    "Interface",
    "Long",
    "Object",
    "ObjectPrx",
    "Operation",
    "Publisher",
    "Short",
    "Struct",
    "UserException",
    "streamed",
]

Byte = Annotated[int, Meta(ge=0, le=255)]
"""Slice's byte."""
Short = Annotated[int, Meta(ge=-(1 << 15), le=(1 << 15) - 1)]
"""Slice's short."""
Int = Annotated[int, Meta(ge=-(1 << 31), le=(1 << 31) - 1)]
"""Slice's int."""
Long = Annotated[int, Meta(ge=-(1 << 63), le=(1 << 63) - 1)]
"""Slice's long."""


class Struct(msgspec.Struct):
    """The root of generated structs: mutable, every member required, compared by value."""
