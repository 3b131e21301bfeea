"""Turn any value into what JSON can hold, for people to read: cut to a size, whatever it is."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

import msgspec

from zenoh_ice import Sample

from ..variables import short_repr

__all__ = ["readable", "without_addresses"]

_MOST_NODES: Final = 256
_LONGEST_TEXT: Final = 1024
_DEEPEST: Final = 8
_LARGEST_INTEGER: Final = 2**53
_SCALARS: Final = frozenset({bool, type(None)})
_ADDRESS: Final = re.compile(r" at 0x[0-9a-fA-F]+")


def readable(value: object) -> Any:  # noqa: ANN401 - JSON
    """Return a value as JSON knows it.

    Numbers that JSON lacks become texts (`nan`, `inf`), bytes tell their number, structs and mappings become
    objects, other objects their repr without addresses. After 256 elements, 8 levels, or 1024 characters
    `...` stands for the rest. The same value makes the same JSON in every process.
    """
    kind = type(value)
    if kind in _SCALARS:
        return value
    if kind is float:
        return value if math.isfinite(value) else repr(value)  # type: ignore[arg-type]
    if kind is int and -_LARGEST_INTEGER <= value <= _LARGEST_INTEGER:  # type: ignore[operator]
        return value
    return _Walk().convert(value, 0)


def without_addresses(text: str) -> str:
    """Return a text without the addresses of objects, which are others in each process."""
    return _ADDRESS.sub("", text)


class _Walk:
    """One conversion, and what is left of its size."""

    def __init__(self) -> None:
        self._left = _MOST_NODES

    def convert(self, value: object, depth: int) -> Any:  # noqa: ANN401
        self._left -= 1
        if value is None or isinstance(value, bool):
            return value
        if isinstance(value, float):
            number = float(value)
            return number if math.isfinite(number) else repr(number)
        if isinstance(value, int):
            number = int(value)
            return number if -_LARGEST_INTEGER <= number <= _LARGEST_INTEGER else short_repr(number)
        if isinstance(value, str):
            text = value if len(value) <= _LONGEST_TEXT else f"{value[:_LONGEST_TEXT]}..."
            return text.encode("utf-8", "backslashreplace").decode()
        if isinstance(value, bytes | bytearray | memoryview):
            return f"<{memoryview(value).nbytes} bytes>"
        if depth >= _DEEPEST:
            return "..."
        return self._convert_container(value, depth + 1)

    def _convert_container(self, value: object, depth: int) -> Any:  # noqa: ANN401
        if isinstance(value, msgspec.Struct):
            return self._object(
                ((name, getattr(value, name, None)) for name in value.__struct_fields__), depth
            )
        if type(value) is dict or (isinstance(value, Mapping) and _is_plain(value)):
            return self._object(value.items(), depth)
        if type(value) in (list, tuple) or (isinstance(value, Sequence) and _is_plain(value)):
            return self._array(value, depth)
        if isinstance(value, set | frozenset) and _is_plain(value):
            # In an order that does not depend on the process; to sort millions would take too long.
            return self._array(sorted(value, key=_rank) if len(value) <= _MOST_NODES else ["..."], depth)
        if isinstance(value, Sample):
            return {"sequence": value.sequence, "value": self.convert(value.value, depth)}
        return without_addresses(short_repr(value))

    def _object(self, items: Any, depth: int) -> dict[str, Any]:  # noqa: ANN401
        found: dict[str, Any] = {}
        for key, item in items:
            if self._left <= 0:
                found["..."] = "..."
                break
            found[key if isinstance(key, str) else short_repr(key)] = self.convert(item, depth)
        return found

    def _array(self, items: Any, depth: int) -> list[Any]:  # noqa: ANN401
        found: list[Any] = []
        for item in items:
            if self._left <= 0:
                found.append("...")
                break
            found.append(self.convert(item, depth))
        return found


def _is_plain(value: object) -> bool:
    """Return whether it is safe to walk through: not what user code defined, nor what computes its items."""
    return type(value).__module__ in ("builtins", "collections", "types")


def _rank(value: object) -> tuple[str, str]:
    return type(value).__name__, short_repr(value)
