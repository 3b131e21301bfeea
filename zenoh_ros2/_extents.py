"""How large messages can be and how much they hold, read from their bytes before anything is decoded.

Decoding makes an object for each element of a list, which is a sequence of texts or messages: a megabyte of
tiny ones takes a third of a second. Numbers, and the bytes of images, are not even copied.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping
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
Places = tuple[int, ...]
"""Where something ends that begins at 0, 1, ... 7: alignment depends on nothing else."""


class Extents:
    """The extents of messages by the definitions of their types, as rosbags has them."""

    def __init__(self, definitions: Mapping[str, tuple[Any, Fields]]) -> None:
        self._definitions: Final = definitions
        self._walks: dict[str, _Walk] = {}

    def largest(self, name: str) -> int | None:
        """Return the maximum bytes of a message whose members all have fixed sizes; None for others."""
        steps = self._walk(name).steps
        if any(not isinstance(step, _Fixed) for step in steps):
            return None
        return _HEADER + sum(step.ends[0] for step in steps if isinstance(step, _Fixed)) + _PADDING

    def check(self, data: memoryview, name: str) -> None:
        """Raise MessageError for a message with more elements than `MOST_ELEMENTS`, or cut off."""
        if len(data) - _HEADER <= MOST_ELEMENTS:  # each takes a byte at least
            return
        reader = _Reader(data[_HEADER:], "<I" if data[1] else ">I")
        try:
            self._walk(name).advance(reader, 0)
        except (struct.error, IndexError) as error:
            raise MessageError(f"{name}: it is cut off") from error

    def _walk(self, name: str) -> _Walk:
        walk = self._walks.get(name)
        if walk is None:
            _, fields = self._definitions[name]
            walk = self._walks[name] = _Walk([self._step(kind) for _, kind in fields])
        return walk

    def _step(self, kind: Any) -> _Step:  # noqa: ANN401
        node, detail = kind
        if node == Nodetype.NAME:
            return self._walk(detail)
        if node == Nodetype.BASE:
            return _Text() if detail[0] == "string" else _fixed(SIZEMAP[detail[0]], 1)
        element, count = detail
        if node == Nodetype.ARRAY:
            if element[0] == Nodetype.BASE and element[1][0] != "string":
                return _fixed(SIZEMAP[element[1][0]], count)
            return _Walk([self._step(element)] * count)
        if element[0] == Nodetype.BASE and element[1][0] != "string":
            return _Numbers(SIZEMAP[element[1][0]])
        return _List(self._step(element))


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


class _Fixed:
    """Members whose sizes are fixed."""

    def __init__(self, ends: Places) -> None:
        self.ends: Final = ends

    def advance(self, reader: _Reader, at: int) -> int:
        return reader.within(at - at % _ALIGNMENT + self.ends[at % _ALIGNMENT])


class _Text:
    def advance(self, reader: _Reader, at: int) -> int:
        length, begin = reader.length(at)
        return reader.within(begin + length)


class _Numbers:
    """A sequence of numbers."""

    def __init__(self, size: int) -> None:
        self._size: Final = size

    def advance(self, reader: _Reader, at: int) -> int:
        length, begin = reader.length(at)
        return reader.within(_aligned(begin, self._size) + length * self._size if length else begin)


class _List:
    """A sequence of texts or of messages."""

    def __init__(self, element: _Step) -> None:
        self._element: Final = element

    def advance(self, reader: _Reader, at: int) -> int:
        length, at = reader.length(at)
        if length > len(reader.data) - at:
            raise IndexError(length)
        reader.left -= length
        if reader.left < 0:
            raise MessageError(f"its lists have more than {MOST_ELEMENTS} elements")
        advance: Callable[[_Reader, int], int] = self._element.advance
        for _ in range(length):
            at = advance(reader, at)
        return at


class _Walk:
    """The members of a message one after the other; adjacent ones of fixed sizes are one step."""

    def __init__(self, members: Iterable[_Step]) -> None:
        self.steps: list[_Step] = []
        for member in members:
            for step in member.steps if isinstance(member, _Walk) else [member]:
                last = self.steps[-1] if self.steps else None
                if isinstance(step, _Fixed) and isinstance(last, _Fixed):
                    self.steps[-1] = _joined(last, step)
                else:
                    self.steps.append(step)

    def advance(self, reader: _Reader, at: int) -> int:
        for step in self.steps:
            at = step.advance(reader, at)
        return at


_Step = _Fixed | _Text | _Numbers | _List | _Walk


def _aligned(at: int, size: int) -> int:
    return -(-at // size) * size


def _fixed(size: int, count: int) -> _Fixed:
    return _Fixed(tuple(_aligned(begin, size) + size * count for begin in range(_ALIGNMENT)))


def _joined(first: _Fixed, second: _Fixed) -> _Fixed:
    """Return two steps as one."""
    return _Fixed(tuple(end - end % _ALIGNMENT + second.ends[end % _ALIGNMENT] for end in first.ends))
