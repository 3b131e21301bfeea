"""What nodes of Humble read and write, compared with rosbags' messages of that distribution."""

from __future__ import annotations

from typing import Any

import pytest
from rosbags.typesys import Stores, get_typestore

from zenoh_ros2 import MessageError, Types
from zenoh_ros2._codec import OWN_IN_HUMBLE
from zenoh_ros2._messages import DISTRIBUTIONS

RANGE = "sensor_msgs/msg/Range"
EVENT = "lifecycle_msgs/msg/TransitionEvent"
OF_DDS = {
    "rmw_dds_common/msg/Gid",
    "rmw_dds_common/msg/NodeEntitiesInfo",
    "rmw_dds_common/msg/ParticipantEntitiesInfo",
}
"""What only implementations on DDS send."""
GONE = {
    "actionlib_msgs/msg/GoalID",
    "actionlib_msgs/msg/GoalStatus",
    "actionlib_msgs/msg/GoalStatusArray",
    "geometry_msgs/msg/Pose2D",
}
"""What Lyrical has no longer."""
SPLITS = {"rosbag2_interfaces/msg/ReadSplitEvent", "rosbag2_interfaces/msg/WriteSplitEvent"}
CHANGES: list[tuple[str, str, set[str]]] = [
    ("humble", "iron", {RANGE}),
    ("iron", "jazzy", SPLITS),
    ("jazzy", "kilted", set()),
    ("kilted", "lyrical", {EVENT}),
]
"""Messages whose fields, and so whose hashes, change between two distributions, by rosbags 0.11.9."""


@pytest.mark.parametrize(("older", "newer", "changed"), CHANGES)
def test_messages_change_between_distributions_as_is_known(older: str, newer: str, changed: set[str]) -> None:
    before, after = (get_typestore(Stores[f"ROS2_{each.upper()}"]) for each in (older, newer))
    gone = before.types.keys() - after.types.keys()
    assert gone == (GONE if newer == "lyrical" else set())
    differing = {
        name
        for name in before.types.keys() - gone - OF_DDS
        if before.hash_rihs01(name) != after.hash_rihs01(name)
    }
    assert differing == changed
    assert changed <= {*OWN_IN_HUMBLE}


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_all_messages_of_humble_have_their_fields_there(distribution: str) -> None:
    types, humble = Types(distribution), get_typestore(Stores.ROS2_HUMBLE)
    newer = get_typestore(DISTRIBUTIONS[distribution])
    for name in humble.fielddefs.keys() - OF_DDS - (GONE - newer.types.keys()):
        assert types.differs(name) == (humble.hash_rihs01(name) != newer.hash_rihs01(name)), name


def test_an_event_of_lyrical_has_its_time_in_humble() -> None:
    types, humble = Types("lyrical"), get_typestore(Stores.ROS2_HUMBLE)
    event = types.make(EVENT, stamp={"sec": 7, "nanosec": 8}, goal_state={"id": 3, "label": "active"})
    written = types.encode(event, humble=True)
    read: Any = humble.deserialize_cdr(written, EVENT)
    assert (read.timestamp, read.goal_state.label) == (7_000_000_008, "active")
    assert types.decode(written, EVENT, humble=True) == event
    assert types.decode(types.encode(event), EVENT) == event


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
