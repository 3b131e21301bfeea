"""What is assigned to a message is converted, or refused by its name, like what is given as a field."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

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
        (STATE, "position", memoryview(array("f", [1.5])), [1.5]),
        (STATE, "position", np.ma.masked_array([1.5, 2.5], [False, False]), [1.5, 2.5]),
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
        pytest.param("std_msgs/msg/Float32", "data", 10**400, r"Float32\.data: int too large", id="huge"),
        ("sensor_msgs/msg/LaserScan", "ranges", [1.0, 1e300], r"LaserScan\.ranges: a sequence of float32"),
        (STATE, "position", np.ma.masked_array([1.5, 2.5], [False, True]), r"position: a sequence of float64"),
        (STATE, "position", np.array(1.5), r"position: a sequence is expected, not ndarray"),
        (STATE, "name", np.array("a"), r"name: a sequence is expected, not ndarray"),
        (STATE, "name", np.array([1], ">i2").data, r"name\[0\]: text"),
        (STATE, "name", ["a", "b\0"], r"JointState\.name\[1\]: text"),
        ("sensor_msgs/msg/CameraInfo", "k", np.array(1.5), r"k: a sequence is expected, not ndarray"),
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


def test_a_field_that_was_deleted_is_zero_and_one_in_its_place_is_named() -> None:
    state = jazzy().make(STATE, name=["a"], position=[1.0])
    del state.position
    assert jazzy().decode(jazzy().encode(state), STATE).position.tolist() == []
    state.positions = np.array([1.0])
    with pytest.raises(MessageError, match=r"JointState: there is no field 'positions'"):
        jazzy().encode(state)


def test_a_field_whose_name_is_a_word_of_python_is_written_whether_given_or_assigned() -> None:
    types = Types("jazzy")
    types.add("test_msgs/msg/Route", "float64 from\nfloat64[] class\n")
    given = types.make("test_msgs/msg/Route", {"from": 1.5, "class": [2.5]})
    assigned = types.make("test_msgs/msg/Route")
    assigned.from_, assigned.class_ = 1.5, np.array([2.5], np.float32)
    assert types.encode(assigned) == types.encode(given)
    other = Types("jazzy")
    other.add("test_msgs/msg/Route", "float64 from\nfloat64[] class\n")
    assert other.encode(assigned) == types.encode(given)


def test_what_is_no_field_of_a_message_in_another_is_named() -> None:
    state = jazzy().make(STATE)
    state.header.frame = "torso"
    with pytest.raises(MessageError, match=r"JointState\.header: there is no field 'frame'"):
        jazzy().encode(state)


class Numbers(np.ndarray[tuple[int], np.dtype[np.float64]]):
    """A subclass of arrays."""


KINDS = (
    *("bool", "byte", "char", "int8", "uint16", "int64", "float32", "float64", "string", "string<=2"),
    *(
        "string[]",
        "string[2]",
        "string<=2[]",
        "string[<=2]",
        "geometry_msgs/Point[]",
        "geometry_msgs/Point[2]",
    ),
    *("geometry_msgs/Point[<=2]", "std_msgs/Header"),
)
"""The types of fields, but arrays of numbers."""
ARRAYS = (
    *(
        "bool[]",
        "bool[3]",
        "byte[<=3]",
        "char[]",
        "int8[3]",
        "uint16[<=2]",
        "int64[]",
        "uint64[2]",
        "float32[]",
    ),
    *("float64[3]", "float64[]"),
)
DTYPES = ("?", "i1", "u1", "i2", ">i2", "u4", "i8", ">u8", "f2", ">f4", "f8", "g", "c8", "O", "U1", "S1")
SCALARS: list[object] = [
    *(
        None,
        True,
        -1,
        2,
        200,
        70_000,
        2**63,
        10**400,
        1.5,
        1e300,
        float("inf"),
        1j,
        "",
        "ab",
        "abc",
        "\0",
        b"ab",
    ),
    *(
        np.bool_(True),
        np.int8(-3),
        np.float16(1.5),
        np.float64(2),
        np.str_("ab"),
        np.array(1.5),
        np.array("a"),
    ),
    *({}, {"x": 1}, {"frame_id": "a"}, {"no": 1}),
]


def read_only(array: Any) -> Any:
    """Return an array that cannot be written."""
    array.flags.writeable = False
    return array


FORMS: dict[str, Callable[[Any], object]] = {
    "plain": lambda array: array,
    "read only": read_only,
    "reversed": lambda array: array[::-1],
    "strided": lambda array: np.repeat(array, 2)[::2],
    "column": lambda array: array.reshape(-1, 1),
    "subclass": lambda array: array.view(Numbers),
    "unmasked": lambda array: np.ma.masked_array(array, False),
    "masked": lambda array: np.ma.masked_array(array, True),
    "list": lambda array: array.tolist(),
    "tuple": tuple,
    "memoryview": memoryview,
    "iterator": iter,
}
"""Forms of arrays, most of which cannot be copied as they are."""
values_of_arrays = st.builds(
    lambda form, dtype, length: FORMS[form](np.ones(length, dtype)),
    st.sampled_from([*FORMS]),
    st.sampled_from(DTYPES),
    st.integers(0, 4),
)


@cache
def made_of(kind: str) -> tuple[Types, Any, str]:
    """Return types and rosbags' store with a message that has one field, and the message's name."""
    types, store, name = (
        jazzy(),
        get_typestore(Stores.ROS2_JAZZY),
        f"own_msgs/msg/Own{[*KINDS, *ARRAYS].index(kind)}",
    )
    types.add(name, f"{kind} value")
    store.register(get_types_from_msg(f"{kind} value", name))
    return types, store, name


def outcome(kind: str, value: object, *, assign: bool) -> bytes | str:
    """Return what is written of a message with a value, or why not."""
    types, _, name = made_of(kind)
    try:
        message = types.make(name, {} if assign else {"value": value})
        if assign:
            message.value = value
        return types.encode(message)
    except MessageError as error:
        return str(error)


def outcomes_are_equal(kind: str, value: object) -> Any:
    """Check that a value given or assigned has one outcome; return what rosbags reads, None if it is refused."""
    _, store, name = made_of(kind)
    written = outcome(kind, value, assign=False)
    assert outcome(kind, value, assign=True) == written, value
    if isinstance(written, str):
        return None
    read = store.deserialize_cdr(written, name).value
    assert outcome(kind, read, assign=True) == written, value
    return read


@pytest.mark.parametrize("kind", [*KINDS, *ARRAYS])
def test_any_value_is_written_alike_or_refused_alike_whether_given_or_assigned(kind: str) -> None:
    for value in SCALARS:
        outcomes_are_equal(kind, value)
        for count in range(5):
            outcomes_are_equal(kind, [value] * count)


@settings(max_examples=400)
@given(st.sampled_from([*ARRAYS, "string[]"]), values_of_arrays)
def test_any_array_is_written_alike_or_refused_alike_whether_given_or_assigned(kind: str, value: Any) -> None:
    read = outcomes_are_equal(kind, value)
    if isinstance(read, np.ndarray) and read.size:
        np.testing.assert_array_equal(read, np.asarray(value).astype(read.dtype))
