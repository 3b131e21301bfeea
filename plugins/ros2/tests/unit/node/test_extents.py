"""The extents of messages, read from their bytes, beside what decoding them finds."""

from __future__ import annotations

import pytest

from plugins.ros2.tests.unit.node.test_messages_recorded import MESSAGES, types
from zenoh_ros2 import MessageError, Types
from zenoh_ros2._extents import MOST_ELEMENTS, Extents

__all__ = ["types"]

NAMES = "sensor_msgs/msg/JointState"


@pytest.fixture(scope="module")
def extents(types: Types) -> Extents:
    return Extents(types._store.fielddefs)


@pytest.mark.slow
def test_no_recorded_message_is_larger_than_its_type_allows(types: Types, extents: Extents) -> None:
    fixed = 0
    for recorded in MESSAGES:
        name = recorded["type"]
        written = types.encode(types.make(name, recorded["values"]))  # which reads its definition
        largest = extents.largest(name)
        if largest is not None:
            fixed += 1
            assert len(written) <= largest, name
    assert fixed > 50


def test_a_long_message_is_walked_to_its_end(types: Types, extents: Extents) -> None:
    for count in (9_000, 20_000, MOST_ELEMENTS):
        message = types.make(
            NAMES, {"name": ["j" * (i % 5) for i in range(count)], "position": [1.0] * count}
        )
        data = types.encode(message)
        extents.check(memoryview(data), NAMES)
        with pytest.raises(MessageError, match="cut off"):
            extents.check(memoryview(data[:-60_000]), NAMES)


def test_a_length_beyond_the_message_is_not_believed(types: Types, extents: Extents) -> None:
    data = bytearray(types.encode(types.make(NAMES, {"name": ["joint"] * 9_000})))
    place = data.index((9_000).to_bytes(4, "little"))
    data[place : place + 4] = (0xFFFFFFFF).to_bytes(4, "little")
    with pytest.raises(MessageError, match="cut off"):
        extents.check(memoryview(bytes(data)), NAMES)
