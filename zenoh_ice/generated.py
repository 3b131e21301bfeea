"""What generated code imports; nobody else needs this module."""

from __future__ import annotations

from collections.abc import Coroutine
from concurrent.futures import Future
from typing import Annotated, Any, TypeAlias, TypeVar

from msgspec import Meta

from ._values import Struct, Value
from .exceptions import UserException
from .interface import Interface, Operation
from .proxy import ObjectPrx, streamed
from .servant import Current, Object
from .streams import Publisher

__all__ = [
    "Byte",
    "Current",
    "Dispatched",
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
    "Value",
    "streamed",
]

V = TypeVar("V")

Dispatched: TypeAlias = V | Future[V] | Coroutine[Any, Any, V]
"""What the method of an operation marked ["amd"] returns: its value now, or what has it later."""

# Slice's integers.
Byte = Annotated[int, Meta(ge=0, le=255)]
Short = Annotated[int, Meta(ge=-(1 << 15), le=(1 << 15) - 1)]
Int = Annotated[int, Meta(ge=-(1 << 31), le=(1 << 31) - 1)]
Long = Annotated[int, Meta(ge=-(1 << 63), le=(1 << 63) - 1)]
