"""Messages by their ROS names: values, CDR, definitions and hashes."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenoh_ros2 import DefinitionError, MessageError, Types, TypeUnknownError

CLOCK = bytes.fromhex("000100000700000008000000")  # genuine: sec 7, nanosec 8


@cache
def jazzy() -> Types:
    """Return the types; rosbags takes long to load them."""
    return Types("jazzy")


def test_genuine_bytes_are_read_and_written() -> None:
    clock = jazzy().make("rosgraph_msgs/msg/Clock", clock={"sec": 7, "nanosec": 8})
    assert jazzy().encode(clock) == CLOCK
    assert jazzy().decode(CLOCK, "rosgraph_msgs/msg/Clock") == clock


def test_big_endian_is_read() -> None:
    clock = jazzy().decode(bytes.fromhex("000000000000000700000008"), "rosgraph_msgs/msg/Clock")
    assert (clock.clock.sec, clock.clock.nanosec) == (7, 8)


def test_what_is_not_given_is_zero() -> None:
    scan = jazzy().make("sensor_msgs/msg/LaserScan", ranges=[1, 2.5], header={"frame_id": "laser"})
    assert scan.ranges.dtype == np.float32
    assert scan.ranges.tolist() == [1.0, 2.5]
    assert jazzy().make("geometry_msgs/msg/Pose").orientation.w == 1.0
    assert (scan.range_max, scan.header.frame_id, scan.header.stamp.sec) == (0.0, "laser", 0)


@pytest.mark.parametrize(
    ("name", "fields", "why"),
    [
        ("geometry_msgs/msg/Twist", {"linear": {"z_": 1}}, r"Twist\.linear: there is no field 'z_'; do you mean z\?"),
        ("geometry_msgs/msg/Twist", {"linear": {"x": "fast"}}, r"Twist\.linear\.x: a number is expected, not 'fast'"),
        ("geometry_msgs/msg/Twist", {"linear": {"x": True}}, r"linear\.x: a number is expected"),
        ("std_msgs/msg/Float64", {"data": 10**400}, r"Float64\.data: int too large"),
        ("std_msgs/msg/UInt8", {"data": 256}, r"UInt8\.data: a whole number from 0 to 255"),
        ("std_msgs/msg/UInt8", {"data": 1.5}, "whole number"),
        ("std_msgs/msg/String", {"data": 5}, r"String\.data: text"),
        ("std_msgs/msg/String", {"data": "a\0b"}, "without zero characters"),
        ("std_msgs/msg/Bool", {"data": 1}, "True or False"),
        ("sensor_msgs/msg/LaserScan", {"ranges": ["near"]}, r"ranges: a sequence of float32 is expected"),
        ("sensor_msgs/msg/LaserScan", {"ranges": 3}, "a sequence is expected, not int"),
        ("sensor_msgs/msg/Image", {"data": [300]}, r"data: a sequence of uint8"),
        ("sensor_msgs/msg/CameraInfo", {"k": [1.0]}, r"k: exactly 9 elements are expected, not 1"),
        ("tf2_msgs/msg/TFMessage", {"transforms": [{"child_frame_id": 1}]}, r"transforms\[0\]\.child_frame_id"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_named(name: str, fields: dict[str, object], why: str) -> None:
    with pytest.raises(MessageError, match=why):
        jazzy().make(name, fields)


def test_values_of_other_widths_are_written() -> None:
    joints = jazzy()["sensor_msgs/msg/JointState"](
        jazzy().make("std_msgs/msg/Header"), ["a"], [0.5], (1.5,), np.array([2], np.float32)
    )
    read = jazzy().decode(jazzy().encode(joints), "sensor_msgs/msg/JointState")
    assert (read.position.tolist(), read.velocity.tolist(), read.effort.tolist()) == ([0.5], [1.5], [2.0])


def test_a_message_of_another_type_is_refused() -> None:
    with pytest.raises(MessageError, match="this is a std_msgs/msg/String"):
        jazzy().coerce("std_msgs/msg/Bool", jazzy().make("std_msgs/msg/String"))


def test_an_unknown_type_names_what_is_near() -> None:
    with pytest.raises(TypeUnknownError, match=r"do you mean geometry_msgs/msg/Twist\?"):
        jazzy()["geometry_msgs/msg/Twistt"]


def test_the_fields_are_as_a_definition_writes_them() -> None:
    fields = jazzy().fields("sensor_msgs/msg/CameraInfo")
    assert (fields["header"], fields["d"], fields["k"]) == ("std_msgs/msg/Header", "float64[]", "float64[9]")
    assert jazzy().fields("std_srvs/srv/Trigger_Request") == {}


def test_messages_services_and_actions_are_added_by_their_text() -> None:
    types = Types("jazzy")
    types.add("own/msg/Ball", "geometry_msgs/Point place  # where\nstring<=5 color\nuint8[<=2] seen\n")
    types.add("own/srv/Find", "string color\n---\nBall[] balls\n")
    types.add("own/action/Fetch", "Ball ball\n---\nbool held\n---\nfloat32 left\n")
    assert types.fields("own/msg/Ball") == {
        "place": "geometry_msgs/msg/Point", "color": "string<=5", "seen": "uint8[<=2]",
    }  # fmt: skip
    assert types.fields("own/action/Fetch_SendGoal_Request") == {
        "goal_id": "unique_identifier_msgs/msg/UUID", "goal": "own/action/Fetch_Goal",
    }  # fmt: skip
    found = types.make("own/srv/Find_Response", balls=[{"color": "red", "place": {"x": 1.0}}])
    assert types.decode(types.encode(found), "own/srv/Find_Response").balls[0].place.x == 1.0
    with pytest.raises(MessageError, match="at most 5 bytes"):
        types.make("own/msg/Ball", color="orange")
    assert "own/srv/Find" in types.names("srv")
    assert "own/action/Fetch" in types.names("action")


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("own/msg/Ball", "float32 x[", "own/msg/Ball"),
        ("own/msg/Ball", "floot32 x", "it needs own/msg/floot32, which is not known"),
        ("own/msg/Ball", "Ball[] more", "it needs own/msg/Ball, which is not known"),
        ("Ball", "float32 x", "write PACKAGE/msg/NAME"),
        ("own/srv/Find", "string color\n", "2 parts divided by lines of '---' are needed, not 1"),
        ("own/msg/Ball", "\n" * 300_000, "at most 262144 characters"),
        ("std_msgs/msg/String", "int32 data\n", "already present with different definition"),
    ],
)
def test_a_bad_definition_is_refused(name: str, text: str, why: str) -> None:
    with pytest.raises(DefinitionError, match=why):
        Types("jazzy").add(name, text)


def test_definitions_are_loaded_from_a_folder(tmp_path: Path) -> None:
    for place, text in {
        "own_msgs/msg/Ball.msg": "float32 x\n",
        "own_msgs/srv/Kick.srv": "Ball ball\n---\n",
        "own_msgs/README.msg": "not in a folder msg\n",
    }.items():
        path = tmp_path / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    types = Types("jazzy")
    assert types.load(tmp_path) == ["own_msgs/msg/Ball", "own_msgs/srv/Kick"]
    assert types.fields("own_msgs/srv/Kick_Request") == {"ball": "own_msgs/msg/Ball"}
    with pytest.raises(DefinitionError, match=r"Away\.msg"):
        types.load(tmp_path / "own_msgs" / "msg" / "Away.msg")


def test_a_distribution_is_chosen_by_its_name_and_humble_takes_hashes_of_jazzy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ROS_DISTRO", "humble")
    trigger = "std_srvs/srv/Trigger"
    assert Types().hash(trigger) == jazzy().hash(trigger)


@pytest.mark.parametrize("name", ["galactic", "noetic", "lyrical2"])
def test_an_older_distribution_and_what_is_none_are_refused(name: str) -> None:
    with pytest.raises(TypeUnknownError, match="the distributions are humble, iron, jazzy, kilted, lyrical"):
        Types(name)


@pytest.mark.parametrize(("name", "known"), [("lyrical", True), ("rolling", True), ("mossy", False)])
def test_later_distributions_have_the_newest_messages(
    name: str, known: bool, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("ROS_DISTRO", name)
    types = Types()
    assert "stamp" in types.fields("lifecycle_msgs/msg/TransitionEvent")  # since Lyrical
    assert "geometry_msgs/msg/Pose2D" not in types  # until Kilted
    warned = [] if known else ["the distribution mossy of ROS is not known: messages are as in lyrical"]
    assert caplog.messages == warned


PLAIN: dict[str, st.SearchStrategy[dict[str, object]]] = {  # kinds of fields whose values hypothesis makes
    "geometry_msgs/msg/Twist": st.fixed_dictionaries(
        {"linear": st.fixed_dictionaries({"x": st.floats(allow_nan=False)})}
    ),
    "std_msgs/msg/String": st.fixed_dictionaries(
        {"data": st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]))}
    ),
    "sensor_msgs/msg/JointState": st.fixed_dictionaries(
        {
            "name": st.lists(st.text("abc", max_size=5), max_size=5),
            "position": st.lists(st.floats(allow_nan=False), max_size=5),
        }
    ),
    "std_msgs/msg/Int64": st.fixed_dictionaries({"data": st.integers(-(2**63), 2**63 - 1)}),
}


@given(st.data())
def test_what_is_written_is_read(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(sorted(PLAIN)))
    fields = data.draw(PLAIN[name])
    message = jazzy().make(name, fields)
    written = jazzy().encode(message)
    assert jazzy().encode(jazzy().decode(written, name)) == written


def test_a_message_with_constants_may_stand_in_another() -> None:
    result = jazzy().make("control_msgs/action/FollowJointTrajectory_Result", error_code=-5)
    outer = jazzy().make(
        "control_msgs/action/FollowJointTrajectory_GetResult_Response", status=6, result=result
    )
    assert outer.result.error_code == -5


def test_a_buffer_is_used_again_for_messages_of_any_length() -> None:
    types, buffer = jazzy(), bytearray()
    for size in (100_000, 10, 100_000, 100_000, 0, 200_000):
        image = types.make("sensor_msgs/msg/Image", encoding="rgb8", data=np.full(size, size % 251, np.uint8))
        types.encode_into(buffer, image)
        assert buffer == types.encode(image)
        image.height = -1
        with pytest.raises(MessageError, match=r"Image\.height: a whole number"):
            types.encode_into(buffer, image)
