"""Imports of generated code; nothing else needs this module."""

from __future__ import annotations

from abc import abstractmethod
from enum import IntEnum
from typing import Annotated

from msgspec import Meta

from zenoh_ice.data.exceptions import UserException
from zenoh_ice.data.values import NULL, Struct, Value
from zenoh_ice.objects._servant import Current, Object, publisher
from zenoh_ice.objects.proxy import ObjectPrx, operation, stream

__all__ = [
    "NULL",
    "Byte",
    "Current",
    "Int",
    "IntEnum",
    "Long",
    "Object",
    "ObjectPrx",
    "Short",
    "Struct",
    "UserException",
    "Value",
    "abstractmethod",
    "operation",
    "publisher",
    "stream",
]

# Slice's integers.
Byte = Annotated[int, Meta(ge=0, le=255)]
Short = Annotated[int, Meta(ge=-(1 << 15), le=(1 << 15) - 1)]
Int = Annotated[int, Meta(ge=-(1 << 31), le=(1 << 31) - 1)]
Long = Annotated[int, Meta(ge=-(1 << 63), le=(1 << 63) - 1)]
