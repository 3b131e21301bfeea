"""Names, keys, tokens and attachments, by the examples of rmw_zenoh's design."""

from __future__ import annotations

import pytest
from hypothesis import given

from tests.support.any_text import any_text
from zenoh_ros2 import LATCHED, SENSOR_DATA, Entity, InvalidNameError, QoS, RosError
from zenoh_ros2._wire import Attachment, check_node_name, dds_name, domain_id, key, resolve, ros_name

HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
ZID = "aac3178e146ba6f1fc6e6a4085e77f21"


def test_the_key_of_a_topic() -> None:
    assert key(0, "/robot1/chatter", "std_msgs/msg/String", HASH) == (
        f"0/robot1/chatter/std_msgs::msg::dds_::String_/{HASH}"
    )


def test_the_token_of_a_node() -> None:
    node = Entity("NN", 0, ZID, 0, 0, "/", "listener")
    assert node.token() == f"@ros2_lv/0/{ZID}/0/0/NN/%/%/listener"
    assert Entity.parse(node.token()) == node


def test_the_token_of_a_publisher() -> None:
    talker = Entity("MP", 0, ZID, 0, 11, "/", "talker", "/chatter", "std_msgs/msg/String", HASH, QoS(depth=7))
    assert talker.token() == (
        f"@ros2_lv/0/{ZID}/0/11/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{HASH}/::,7:,:,:,,"
    )
    assert Entity.parse(talker.token()) == talker


def test_a_namespace_and_a_service() -> None:
    add = Entity("SS", 2, ZID, 0, 3, "/a/b", "n", "/a/b/add", "example_interfaces/srv/AddTwoInts", HASH)
    assert add.token() == (
        f"@ros2_lv/2/{ZID}/0/3/SS/%/%a%b/n/%a%b%add/example_interfaces::srv::dds_::AddTwoInts_/{HASH}/::,10:,:,:,,"
    )
    assert add.node_name == "/a/b/n"
    assert Entity.parse(add.token()) == add


@pytest.mark.parametrize(
    ("qos", "text"),
    [
        (QoS(), "::,10:,:,:,,"),
        (SENSOR_DATA, "2::,5:,:,:,,"),
        (LATCHED, ":1:,1:,:,:,,"),
        (QoS(keep_all=True), "::2,:,:,:,,"),
    ],
)
def test_the_qos_of_tokens(qos: QoS, text: str) -> None:
    assert qos.encode() == text
    decoded = QoS.decode(text)
    assert (decoded.reliability, decoded.durability, decoded.keep_all) == (
        qos.reliability,
        qos.durability,
        qos.keep_all,
    )
    assert qos.keep_all or decoded == qos


def test_a_token_may_have_more_parts() -> None:
    """As for rmw_zenoh: a later version may append some."""
    token = f"@ros2_lv/0/{ZID}/0/11/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{HASH}/::,7:,:,:,,"
    assert Entity.parse(f"{token}/cpu:") == Entity.parse(token) is not None


@given(any_text(max_size=60))
def test_any_token_is_read_or_refused(text: str) -> None:
    QoS.decode(text)
    Entity.parse(f"@ros2_lv/0/{ZID}/0/11/MP/%/%/talker/%chatter/{text}/{HASH}/::,7:,:,:,,")
    Entity.parse(text)


@pytest.mark.parametrize(
    "token",
    [
        "0/chatter",
        f"@ros2_lv/x/{ZID}/0/0/NN/%/%/listener",
        f"@ros2_lv/0/{ZID}/0/0/XX/%/%/listener",
        f"@ros2_lv/0/{ZID}/0/0/MP/%/%/listener",
        f"@ros2_lv/0/{ZID}/0/0/NN/%/%/" + "n" * 5000,
    ],
)
def test_what_is_no_token_is_refused(token: str) -> None:
    assert Entity.parse(token) is None


def test_the_gid_is_that_of_the_token() -> None:
    """The hash XXH3-128 of an empty input is 99aa06d3014798d86001c324468d497f (the high half first)."""
    import xxhash

    node = Entity("NN", 0, ZID, 0, 0, "/", "listener")
    high, low = divmod(xxhash.xxh3_128_intdigest(node.token().encode()), 1 << 64)
    assert node.gid() == low.to_bytes(8, "little") + high.to_bytes(8, "little")


def test_the_attachment_has_33_bytes() -> None:
    attachment = Attachment(5, 7, bytes(range(16)))
    assert attachment.encode() == bytes([5, *[0] * 7, 7, *[0] * 7, 16, *range(16)])
    assert Attachment.decode(attachment.encode()) == attachment
    assert Attachment.decode(attachment.encode()[:-1]) is None
    assert Attachment.decode(attachment.encode()[:16] + b"\x0f" + bytes(16)) is None


@pytest.mark.parametrize(
    ("name", "full"),
    [
        ("/scan", "/scan"),
        ("scan", "/lab/scan"),
        ("~/stop", "/lab/nao/stop"),
        ("a/b", "/lab/a/b"),
    ],
)
def test_names_are_resolved(name: str, full: str) -> None:
    assert resolve(name, "nao", "/lab") == full


@pytest.mark.parametrize(
    "name", ["", "/", "~a", "a b", "/1a", "a//b", "a__b", "/a/", "**", "ä", "/" + "a" * 300]
)
def test_what_is_no_name_is_refused(name: str) -> None:
    with pytest.raises(InvalidNameError):
        resolve(name, "nao", "/")


def test_nodes_and_domains_are_checked() -> None:
    assert check_node_name("nao", "lab/red") == "/lab/red"
    for name, namespace in (("1nao", "/"), ("a/b", "/"), ("nao", "/a b")):
        with pytest.raises(InvalidNameError):
            check_node_name(name, namespace)
    assert domain_id("17") == 17
    for domain in (-1, 233, "x", None, 1.5):
        with pytest.raises(RosError, match="ROS_DOMAIN_ID"):
            domain_id(domain)


def test_types_are_translated() -> None:
    assert dds_name("std_msgs/msg/String") == "std_msgs::msg::dds_::String_"
    assert ros_name("example_interfaces::action::dds_::Fibonacci_SendGoal_") == (
        "example_interfaces/action/Fibonacci_SendGoal"
    )


def test_a_qos_is_checked() -> None:
    for bad in ({"depth": 0}, {"depth": 10**6}, {"reliability": "sure"}, {"durability": "forever"}):
        with pytest.raises(RosError, match="QoS"):
            QoS(**bad)
