"""How large messages can be and how much they hold, read from their bytes before anything is decoded.

Decoding makes an object for each element of a list, which is a sequence of texts or messages: a megabyte of
tiny ones takes a third of a second. Numbers, and the bytes of images, are not even copied.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from rosbags.interfaces import Nodetype
from rosbags.serde.utils import SIZEMAP

from .exceptions import MessageError

MOST_ELEMENTS: Final = 50_000
"""Maximum elements of all lists of a message together."""

_HEADER: Final = 4
"""Bytes before a message, which say how it is encoded; places in a message are counted from their end."""
_PADDING: Final = 3
"""Bytes that may follow a message."""
_ALIGNMENT: Final = 8  # bytes
_LENGTH: Final = 4

Fields = Iterable[tuple[str, Any]]
_Places = tuple[int, ...]
"""Where members of fixed sizes end that begin at 0, 1, ... 7: alignment depends on nothing else."""
_Step = _Places | Callable[["_Reader", int], int]
"""Members of fixed sizes, or a function that returns where a member ends that begins at a place."""


class Extents:
    """The extents of messages by the definitions of their types, as rosbags has them."""

    def __init__(self, definitions: Mapping[str, tuple[Any, Fields]]) -> None:
        self._definitions: Final = definitions
        self._steps: dict[str, list[_Step]] = {}

    def largest(self, name: str) -> int | None:
        """Return the maximum bytes of a message whose members all have fixed sizes; None for others."""
        steps = self._steps_of(name)
        fixed = [step for step in steps if isinstance(step, tuple)]
        return None if len(fixed) < len(steps) else _HEADER + sum(ends[0] for ends in fixed) + _PADDING

    def check(self, data: memoryview, name: str) -> None:
        """Raise MessageError for a message with more elements than `MOST_ELEMENTS`, or cut off."""
        if len(data) - _HEADER <= MOST_ELEMENTS:  # each takes a byte at least
            return
        reader = _Reader(data[_HEADER:], "<I" if data[1] else ">I")
        try:
            _end(self._steps_of(name), reader, 0)
        except (struct.error, IndexError) as error:
            raise MessageError(f"{name}: it is cut off") from error

    def _steps_of(self, name: str) -> list[_Step]:
        if name not in self._steps:
            _, fields = self._definitions[name]
            self._steps[name] = _joined(step for _, kind in fields for step in self._of_member(kind))
        return self._steps[name]

    def _of_member(self, kind: Any) -> list[_Step]:  # noqa: ANN401
        node, detail = kind
        if node == Nodetype.NAME:
            return self._steps_of(detail)
        if node == Nodetype.BASE:
            return [_end_of_text] if detail[0] == "string" else [_fixed(SIZEMAP[detail[0]], 1)]
        element, count = detail
        is_number = element[0] == Nodetype.BASE and element[1][0] != "string"
        if node == Nodetype.ARRAY:
            return [_fixed(SIZEMAP[element[1][0]], count)] if is_number else self._of_member(element) * count
        if is_number:
            return [partial(_end_of_numbers, SIZEMAP[element[1][0]])]
        return [partial(_end_of_list, _joined(self._of_member(element)))]


class _Reader:
    """The bytes of a message, and how many elements of its lists are still allowed."""

    def __init__(self, data: memoryview, length: str) -> None:
        self.data: Final = data
        self.left = MOST_ELEMENTS
        self._length: Final = struct.Struct(length)

    def length(self, at: int) -> tuple[int, int]:
        """Return the length at a place, and where what it counts begins."""
        at = _aligned(at, _LENGTH)
        return self._length.unpack_from(self.data, at)[0], at + _LENGTH

    def within(self, end: int) -> int:
        """Return the end of something, which is not beyond the end of the message."""
        if end > len(self.data):
            raise IndexError(end)
        return end


def _end(steps: Sequence[_Step], reader: _Reader, at: int) -> int:
    """Return where the members of a message end that begin at a place."""
    for step in steps:
        if isinstance(step, tuple):
            at = reader.within(at - at % _ALIGNMENT + step[at % _ALIGNMENT])
        else:
            at = step(reader, at)
    return at


def _end_of_text(reader: _Reader, at: int) -> int:
    length, begin = reader.length(at)
    return reader.within(begin + length)


def _end_of_numbers(size: int, reader: _Reader, at: int) -> int:
    """Return the end of a sequence of numbers."""
    length, begin = reader.length(at)
    return reader.within(_aligned(begin, size) + length * size if length else begin)


def _end_of_list(element: Sequence[_Step], reader: _Reader, at: int) -> int:
    """Return the end of a sequence of texts or of messages."""
    length, at = reader.length(at)
    if length > len(reader.data) - at:
        raise IndexError(length)
    reader.left -= length
    if reader.left < 0:
        raise MessageError(f"its lists have more than {MOST_ELEMENTS} elements")
    for _ in range(length):
        at = _end(element, reader, at)
    return at


def _aligned(at: int, size: int) -> int:
    return -(-at // size) * size


def _fixed(size: int, count: int) -> _Places:
    return tuple(_aligned(begin, size) + size * count for begin in range(_ALIGNMENT))


def _joined(steps: Iterable[_Step]) -> list[_Step]:
    """Return steps, where adjacent ones of fixed sizes are one."""
    found: list[_Step] = []
    for step in steps:
        last = found[-1] if found else None
        if isinstance(step, tuple) and isinstance(last, tuple):
            found[-1] = tuple(end - end % _ALIGNMENT + step[end % _ALIGNMENT] for end in last)
        else:
            found.append(step)
    return found
