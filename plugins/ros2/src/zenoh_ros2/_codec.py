"""Messages as CDR, by the definitions of a distribution; a few have fewer fields in Humble."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from ._extents import Extents
from .exceptions import MessageError

LARGEST_MESSAGE: Final = 64 << 20
"""Maximum bytes of CDR that are decoded."""
_LARGE: Final = 1 << 16
"""Bytes from which the memory of a message is used again."""
_LONGEST_SEQUENCE: Final = 1 << 26

_EVENT: Final = "lifecycle_msgs/msg/TransitionEvent"
_TIMES: Final[Mapping[str, Callable[[Any], object]]] = {
    "timestamp": lambda event: event.stamp.sec * 10**9 + event.stamp.nanosec,
    "stamp": lambda event: {"sec": event.timestamp // 10**9, "nanosec": event.timestamp % 10**9},
}
"""The time of an event, in ns before Lyrical and a stamp since then, read from the other one."""
OWN_IN_HUMBLE: Final = (
    "sensor_msgs/msg/Range",
    "rosbag2_interfaces/msg/ReadSplitEvent",
    "rosbag2_interfaces/msg/WriteSplitEvent",
    _EVENT,
)
"""Messages that have other fields in Humble, the only distribution without type hashes, than later."""

MISFITS: Final = (
    struct.error,
    AssertionError,
    AttributeError,
    OverflowError,
    SerdeError,
    TypeError,
    ValueError,
)
"""Exceptions of `Codec.write` for values that do not fit."""


class Codec:
    """Writes and reads messages by the definitions of a store."""

    def __init__(self, store: Typestore) -> None:
        store.max_sequence_length = _LONGEST_SEQUENCE
        if (event := store.types.get(_EVENT)) is not None:
            own = dict(store.fielddefs[_EVENT][1])
            also = {name: property(read) for name, read in _TIMES.items() if name not in own}
            store.types[_EVENT] = type(event.__name__, (event,), also)
        self._store: Final = store
        self._extents: Final = Extents(store.fielddefs)

    def write(self, buffer: bytearray, message: object, name: str) -> None:
        """Write a message into a buffer, whose length becomes that of the message; raises MISFITS."""
        definition = self._store.get_msgdef(name)
        size = 4 + definition.getsize_cdr(0, message, self._store)
        if len(buffer) != size or size < _LARGE:
            buffer[:] = bytes(size)
        buffer[1] = 1  # little endian
        with memoryview(buffer) as view, view[4:] as body:  # a buffer with views cannot change its length
            end = definition.serialize_cdr_le(body, 0, message, self._store)
        if end + 4 != size:
            raise ValueError(f"{end + 4} bytes were written instead of {size}")

    def largest(self, name: str) -> int:
        """Return the maximum bytes of a message: exactly, if each of its members has a fixed size."""
        largest = self._extents.largest(name)
        return LARGEST_MESSAGE if largest is None else largest

    def read(self, data: bytes | memoryview, name: str) -> Any:  # noqa: ANN401
        """Return a message, with arrays as views of its bytes; raises MessageError, first for its size."""
        largest = self.largest(name)
        if len(data) > largest:
            raise MessageError(f"{name}: {len(data)} bytes; at most {largest} are decoded")
        self._extents.check(memoryview(data), name)
        try:
            return self._store.deserialize_cdr(memoryview(data), name)
        except (SerdeError, struct.error, AssertionError, IndexError, OverflowError, ValueError) as error:
            raise MessageError(f"{name}: {error}") from error


def codec_of_humble(definitions: Mapping[str, tuple[Any, Any]], name: str) -> Codec | None:
    """Return the codec of Humble's nodes for a message; None if they write it as others do."""
    needed = [name]
    for each in needed:
        needed += {*needed_by(definitions[each][1])}.difference(needed)
    humble = get_typestore(Stores.ROS2_HUMBLE).fielddefs
    own = {each: (humble if each in OWN_IN_HUMBLE else definitions)[each] for each in needed}
    if all(own[each][1] == definitions[each][1] for each in needed):
        return None
    store = get_typestore(Stores.EMPTY)
    store.register(own)
    return Codec(store)


def needed_by(fields: Iterable[tuple[str, Any]]) -> Iterator[str]:
    """Yield the types of the fields that are, or are sequences of, messages."""
    for _, (node, detail) in fields:
        if node == Nodetype.NAME:
            yield detail
        elif node != Nodetype.BASE and detail[0][0] == Nodetype.NAME:
            yield detail[0][1]
