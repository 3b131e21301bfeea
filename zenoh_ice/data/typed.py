"""Decode and convert values into types, from any thread.

msgspec reads the annotations of a struct when one is decoded or converted for the first time, and keeps what
it has read so far in the class: another thread that does so meanwhile ends the process (msgspec 0.22). Here
one thread alone reads those of a type, before anything of it is decoded.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Final, TypeVar, overload
from weakref import WeakSet

import msgspec

T = TypeVar("T")
_Text = bytes | bytearray | msgspec.Raw | str
_Hook = Callable[[type, Any], Any]

_READING: Final = threading.RLock()  # annotations may run code that comes here, too
_READ: Final[WeakSet[type]] = WeakSet()


@overload
def convert(value: object, kind: type[T], *, strict: bool = True, from_attributes: bool = False) -> T: ...
@overload
def convert(value: object, kind: Any, *, strict: bool = True, from_attributes: bool = False) -> Any: ...  # noqa: ANN401
def convert(value: object, kind: Any, *, strict: bool = True, from_attributes: bool = False) -> Any:
    """Return a value as one of a type. Raises msgspec.ValidationError."""
    return msgspec.convert(value, _read(kind), strict=strict, from_attributes=from_attributes)


@overload
def from_json(data: _Text, kind: type[T], *, dec_hook: _Hook | None = None) -> T: ...
@overload
def from_json(data: _Text, kind: Any = Any, *, dec_hook: _Hook | None = None) -> Any: ...  # noqa: ANN401
def from_json(data: _Text, kind: Any = Any, *, dec_hook: _Hook | None = None) -> Any:
    """Return the value of a type in a text of JSON. Raises msgspec.DecodeError, msgspec.ValidationError."""
    return msgspec.json.decode(data, type=_read(kind), dec_hook=dec_hook)


@overload
def from_msgpack(data: bytes, kind: type[T]) -> T: ...
@overload
def from_msgpack(data: bytes, kind: Any = Any) -> Any: ...  # noqa: ANN401
def from_msgpack(data: bytes, kind: Any = Any) -> Any:
    """Return the value of a type in MessagePack. Raises msgspec.DecodeError, msgspec.ValidationError."""
    return msgspec.msgpack.decode(data, type=_read(kind))


@overload
def json_decoder(kind: type[T], *, dec_hook: _Hook | None = None) -> Callable[[_Text], T]: ...
@overload
def json_decoder(kind: Any, *, dec_hook: _Hook | None = None) -> Callable[[_Text], Any]: ...  # noqa: ANN401
def json_decoder(kind: Any, *, dec_hook: _Hook | None = None) -> Callable[[_Text], Any]:
    """Return what decodes a text of JSON into a type, quicker than `from_json`."""
    with _READING:
        return msgspec.json.Decoder(kind, dec_hook=dec_hook).decode


@overload
def msgpack_decoder(kind: type[T], *, dec_hook: _Hook | None = None) -> Callable[[bytes], T]: ...
@overload
def msgpack_decoder(kind: Any, *, dec_hook: _Hook | None = None) -> Callable[[bytes], Any]: ...  # noqa: ANN401
def msgpack_decoder(kind: Any, *, dec_hook: _Hook | None = None) -> Callable[[bytes], Any]:
    """Return what decodes MessagePack into a type, quicker than `from_msgpack`."""
    with _READING:
        return msgspec.msgpack.Decoder(kind, dec_hook=dec_hook).decode


def _read(kind: T) -> T:
    """Return a type whose annotations have been read."""
    if kind not in _READ:
        msgpack_decoder(kind)
        if isinstance(kind, type):
            _READ.add(kind)
    return kind
