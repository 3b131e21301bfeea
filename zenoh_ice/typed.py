"""Let msgspec read the annotations of a type in one thread alone, before anything of it is decoded.

It reads those of a struct when that is decoded for the first time, and keeps what it has read so far in the
class: another thread that decodes the same struct meanwhile ends the process (msgspec 0.22).
"""

from __future__ import annotations

import threading
from typing import Final, TypeVar

import msgspec

__all__ = ["READS_TYPES", "settled"]

T = TypeVar("T")

READS_TYPES: Final = threading.RLock()
"""Held while a decoder is made of types that other threads may decode."""


def settled(kind: T) -> T:
    """Return a type whose annotations have been read: now any thread may decode it."""
    with READS_TYPES:
        msgspec.msgpack.Decoder(kind)
    return kind
