"""What nodes of Humble read and write, compared with rosbags' messages of that distribution."""

from __future__ import annotations

import pytest
from rosbags.typesys import Stores, get_typestore

from zenoh_ros2 import MessageError, Types
from zenoh_ros2._codec import NEWER_FIELDS
from zenoh_ros2._messages import DISTRIBUTIONS

RANGE = "sensor_msgs/msg/Range"
OF_DDS = {
    "rmw_dds_common/msg/Gid",
    "rmw_dds_common/msg/NodeEntitiesInfo",
    "rmw_dds_common/msg/ParticipantEntitiesInfo",
}
"""What only implementations on DDS send."""


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_all_messages_of_humble_are_known_and_differ_in_newer_fields_only(distribution: str) -> None:
    humble = get_typestore(Stores.ROS2_HUMBLE).fielddefs
    newer = get_typestore(DISTRIBUTIONS[distribution]).fielddefs
    for name in humble.keys() - OF_DDS:
        left_out = NEWER_FIELDS.get(name, ())
        assert humble[name][1] == [field for field in newer[name][1] if field[0] not in left_out], name


def test_a_message_is_written_for_humble_as_there_and_read_from_it() -> None:
    types, humble = Types("jazzy"), get_typestore(Stores.ROS2_HUMBLE)
    fields = {"header": {"frame_id": "LSonar_frame"}, "max_range": 2.5, "range": 0.5}
    message = types.make(RANGE, fields, variance=0.1)
    written = types.encode(message, humble=True)
    assert humble.serialize_cdr(humble.deserialize_cdr(written, RANGE), RANGE) == written
    assert len(written) < len(types.encode(message))
    assert types.decode(written, RANGE, humble=True) == types.make(RANGE, fields)


def test_an_own_message_has_for_humble_the_parts_of_humble() -> None:
    types = Types("jazzy")
    types.add("peer_msgs/msg/Ring", "sensor_msgs/Range[] ranges\nstring name\n")
    ring = types.make("peer_msgs/msg/Ring", ranges=[{"range": 1.0}, {"range": 2.0}], name="belt")
    assert types.differs("peer_msgs/msg/Ring")
    assert not types.differs("sensor_msgs/msg/Image")
    assert types.decode(types.encode(ring, humble=True), "peer_msgs/msg/Ring", humble=True) == ring


def test_lists_of_humble_are_counted_before_they_are_decoded() -> None:
    types = Types("jazzy")
    types.add("peer_msgs/msg/Ring", "sensor_msgs/Range[] ranges\n")
    bomb = bytes.fromhex("0001000060ea0000") + bytes(60_000)
    with pytest.raises(MessageError, match="its lists have more than 50000 elements"):
        types.decode(bomb, "peer_msgs/msg/Ring", humble=True)
