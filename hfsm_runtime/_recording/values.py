"""Convert any value to readable JSON of limited size."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

import msgspec

from zenoh_ice import Sample

from .._variables import short_repr

_MOST_NODES: Final = 256
_LONGEST_TEXT: Final = 1024
_DEEPEST_VALUE: Final = 8
_LARGEST_INTEGER: Final = 2**53
_ADDRESS: Final = re.compile(r" at 0x[0-9a-fA-F]+")


def readable(value: object) -> Any:  # noqa: ANN401 - JSON
    """Return a value in types of JSON.

    Numbers that JSON lacks become texts (`nan`, `inf`), bytes their number, structs and mappings become
    objects, other objects their repr without addresses. After 256 elements, 8 levels, or 1024 characters
    `...` replaces the rest. The same value makes the same JSON in every process.
    """
    return _convert(value, [_MOST_NODES], 0)


def without_addresses(text: str) -> str:
    """Return a text without the addresses of objects, which differ from process to process."""
    return _ADDRESS.sub("", text)


def _convert(value: Any, left: list[int], depth: int) -> Any:  # noqa: ANN401
    left[0] -= 1
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, float):
        number = float(value)
        return number if math.isfinite(number) else repr(number)
    if isinstance(value, int):
        whole = int(value)
        return whole if -_LARGEST_INTEGER <= whole <= _LARGEST_INTEGER else short_repr(whole)
    if isinstance(value, str):
        text = value if len(value) <= _LONGEST_TEXT else f"{value[:_LONGEST_TEXT]}..."
        return text.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, bytes | bytearray | memoryview):
        return f"<{memoryview(value).nbytes} bytes>"
    if depth >= _DEEPEST_VALUE:
        return "..."
    if isinstance(value, Sample):
        return {"sequence": value.sequence, "value": _convert(value.value, left, depth + 1)}
    if isinstance(value, msgspec.Struct):
        value = {name: getattr(value, name, None) for name in value.__struct_fields__}
    if isinstance(value, Mapping) and _is_plain(value):
        items: dict[str, Any] = {}
        for key, item in value.items():
            if left[0] <= 0:
                return items | {"...": "..."}
            items[key if isinstance(key, str) else short_repr(key)] = _convert(item, left, depth + 1)
        return items
    if isinstance(value, set | frozenset) and _is_plain(value):
        # In an order that does not depend on the process; to sort millions would take too long.
        value = (
            sorted(value, key=lambda item: (type(item).__name__, short_repr(item)))
            if len(value) <= _MOST_NODES
            else ["..."]
        )
    if isinstance(value, Sequence) and _is_plain(value):
        elements: list[Any] = []
        for item in value:
            if left[0] <= 0:
                return [*elements, "..."]
            elements.append(_convert(item, left, depth + 1))
        return elements
    return without_addresses(short_repr(value))


def _is_plain(value: object) -> bool:
    """Return whether a value is safe to iterate over: its class is not user code, and computes no items."""
    return type(value).__module__ in ("builtins", "collections", "types")
