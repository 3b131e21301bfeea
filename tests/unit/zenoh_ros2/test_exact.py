"""What is assigned to a message is converted, or refused by its name, like what is given as a field."""

from __future__ import annotations

from array import array
from functools import cache

import numpy as np
import pytest

from zenoh_ros2 import MessageError, Types


@cache
def jazzy() -> Types:
    """Return the types; rosbags takes long to load them."""
    return Types("jazzy")


TABLE = np.arange(6.0).reshape(3, 2)
STATE, INTS, BYTES = (
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/Int64MultiArray",
    "std_msgs/msg/UInt8MultiArray",
)


@pytest.mark.parametrize(
    ("name", "field", "value", "read"),
    [
        (STATE, "position", np.array([1, 2]), [1.0, 2.0]),
        (STATE, "position", np.array([1.0, 2.0], ">f8"), [1.0, 2.0]),
        (STATE, "position", np.array([1.5, 2.5], np.float16), [1.5, 2.5]),
        (STATE, "position", memoryview(array("d", [1.5, 2.5])), [1.5, 2.5]),
        (STATE, "position", TABLE[:, 1], [1.0, 3.0, 5.0]),
        (STATE, "position", TABLE[0, ::-1], [1.0, 0.0]),
        (STATE, "position", (3,), [3.0]),
        (STATE, "header", {"frame_id": "torso"}, None),
        (STATE, "name", np.array(["a", "bc"]), ["a", "bc"]),
        ("sensor_msgs/msg/LaserScan", "ranges", np.array([1, 2], np.int32), [1.0, 2.0]),
        ("sensor_msgs/msg/CameraInfo", "k", np.arange(9), [*map(float, range(9))]),
        (INTS, "data", np.array([-3], ">i2"), [-3]),
        (BYTES, "data", np.array([7, 8], np.int64), [7, 8]),
        (BYTES, "data", b"ab", [97, 98]),
        ("std_msgs/msg/Float64", "data", np.float32(1.5), 1.5),
        ("std_msgs/msg/Bool", "data", np.bool_(True), True),
    ],
)  # fmt: skip
def test_values_are_converted_whether_given_or_assigned(
    name: str, field: str, value: object, read: object
) -> None:
    given = jazzy().make(name, {field: value})
    assigned = jazzy().make(name)
    setattr(assigned, field, value)
    written = jazzy().encode(assigned)
    assert written == jazzy().encode(given)
    found = getattr(jazzy().decode(written, name), field)
    if read is not None:
        assert (found.tolist() if isinstance(found, np.ndarray) else found) == read


@pytest.mark.parametrize(
    ("name", "field", "value", "why"),
    [
        (INTS, "data", np.array([1.5]), r"Int64MultiArray\.data: a sequence of int64 is expected"),
        (BYTES, "data", np.array([-1], np.int8), r"UInt8MultiArray\.data: a sequence of uint8"),
        (BYTES, "data", TABLE, r"UInt8MultiArray\.data: a sequence of uint8"),
        (STATE, "position", TABLE, r"JointState\.position: a sequence of float64"),
        (STATE, "position", np.array([1j]), r"JointState\.position: a sequence of float64"),
        (STATE, "name", ["a", 5], r"JointState\.name\[1\]: text"),
        (STATE, "name", ["\udc80"], r"JointState\.name\[0\]: text in UTF-8"),
        (STATE, "header", None, r"JointState\.header: a std_msgs/msg/Header is expected, not NoneType"),
        (STATE, "positions", [1.0], r"JointState: there is no field 'positions'; do you mean position\?"),
        ("sensor_msgs/msg/CameraInfo", "k", np.zeros(10), r"CameraInfo\.k: exactly 9 elements"),
        ("std_msgs/msg/Bool", "data", "no", r"Bool\.data: True or False is expected, not 'no'"),
        ("std_msgs/msg/Float64", "data", True, r"Float64\.data: a number is expected"),
        ("std_msgs/msg/Float32", "data", 1e300, r"Float32\.data: float too large"),
        ("std_msgs/msg/Int8", "data", True, r"Int8\.data: a whole number"),
        ("std_msgs/msg/UInt8", "data", 256, r"UInt8\.data: a whole number"),
        ("std_msgs/msg/String", "data", "a\0b", r"String\.data: text"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_whether_given_or_assigned(
    name: str, field: str, value: object, why: str
) -> None:
    with pytest.raises(MessageError, match=why):
        jazzy().make(name, {field: value})
    assigned = jazzy().make(name)
    setattr(assigned, field, value)
    with pytest.raises(MessageError, match=why):
        jazzy().encode(assigned)


def test_values_assigned_within_messages_are_converted_or_named() -> None:
    types, name = jazzy(), "trajectory_msgs/msg/JointTrajectory"
    trajectory = types.make(name, joint_names=["a"], points=[{"positions": [0.0]}, {"positions": [1.0]}])
    trajectory.points[1].positions = np.array([2])
    trajectory.points[1].time_from_start = {"sec": 3}
    read = types.decode(types.encode(trajectory), name)
    assert (read.points[1].positions.tolist(), read.points[1].time_from_start.sec) == ([2.0], 3)
    trajectory.points[1].velocities = np.array(["fast"])
    with pytest.raises(
        MessageError, match=r"JointTrajectory\.points\[1\]\.velocities: a sequence of float64"
    ):
        types.encode(trajectory)


def test_a_message_with_an_assigned_value_does_not_change_by_being_written() -> None:
    state = jazzy().make(STATE)
    state.position = whole = np.array([1, 2])
    jazzy().encode(state)
    assert state.position is whole


def test_values_assigned_to_a_message_are_converted_for_humble_too() -> None:
    sonar = jazzy().make("sensor_msgs/msg/Range")
    sonar.range = np.int64(2)
    assert (
        jazzy().decode(jazzy().encode(sonar, humble=True), "sensor_msgs/msg/Range", humble=True).range == 2.0
    )
