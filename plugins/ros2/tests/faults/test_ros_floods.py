"""Floods from the side of ROS: large messages, slow ones, and thousands of tokens."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest
import zenoh

from plugins.ros2.tests.support.ros_nodes import DOMAIN, Inbox, matched, two_nodes
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.soak import repeated
from tests.support.waiting import until
from zenoh_ros2 import MessageError, Node, QoS, Sender, Types
from zenoh_ros2._graph import MOST_OF_A_NAME
from zenoh_ros2._limits import NodeLimits
from zenoh_ros2._wire import Attachment, EntityKind, key

ANGLES = "naoqi_bridge_msgs/msg/JointAnglesWithSpeed"
TEXT = "std_msgs/msg/String"
TRIGGER = "std_srvs/srv/Trigger"
ATTACHED = Attachment(1, 0, bytes(16)).encode()


def names(count: int) -> bytes:
    """Return a message of many empty names, of 8 bytes each."""
    header = bytes(8) + (1).to_bytes(4, "little") + bytes(4)
    name = (1).to_bytes(4, "little") + bytes(4)
    return b"\0\1\0\0" + header + count.to_bytes(4, "little") + name * count + bytes(16)


TEXT_HASH = Types().hash(TEXT)


class HeldTypes(Types):
    """Types that decode texts only when they are let go."""

    def __init__(self) -> None:
        super().__init__()
        self.held = threading.Event()
        self.let_go = threading.Event()

    def decode(self, data: bytes | memoryview, name: str, *, humble: bool = False) -> Any:
        if name == TEXT:
            self.held.set()
            assert self.let_go.wait(FOREVER)
        return super().decode(data, name, humble=humble)


def test_a_message_that_takes_long_to_decode_delays_no_service() -> None:
    types = HeldTypes()
    with two_nodes(types=types) as (robot, tool), ExitStack() as steps:
        steps.callback(types.let_go.set)
        inbox = Inbox()
        robot.create_subscription(TEXT, "/speech", inbox)
        robot.create_service(TRIGGER, "/stop", lambda _: {"success": True}, urgent=True)
        robot.create_service(TRIGGER, "/reset", lambda _: {"success": True})
        publisher = tool.create_publisher(TEXT, "/speech")
        matched(robot, tool, "/speech")
        publisher.publish(data="slow")
        assert types.held.wait(EVENT_LIMIT)
        for name in ("/stop", "/reset"):
            assert tool.create_client(TRIGGER, name).call(timeout=CALL_LIMIT).success
        assert not inbox.messages
        types.let_go.set()
        assert inbox.wait()[0].data == "slow"


def test_an_urgent_service_waits_for_no_other_callback() -> None:
    free = threading.Event()
    with two_nodes() as (robot, tool), ExitStack() as steps:
        steps.callback(free.set)
        robot.create_service(TRIGGER, "/stop", lambda _: {"success": True}, urgent=True)
        entered = threading.Semaphore(0)

        def hang(_: object) -> object:
            entered.release()
            free.wait(FOREVER)
            return {"success": True}

        for number in range(12):  # more than there are threads for callbacks
            robot.create_service(TRIGGER, f"/hang{number}", hang)
            client = tool.create_client(TRIGGER, f"/hang{number}")
            client.wait(EVENT_LIMIT)
            client.call_async()
        assert entered.acquire(timeout=EVENT_LIMIT)
        assert tool.create_client(TRIGGER, "/stop").call(timeout=CALL_LIMIT).success


def test_a_message_beyond_the_limit_of_its_topic_is_not_decoded(caplog: pytest.LogCaptureFixture) -> None:
    with two_nodes() as (robot, tool), caplog.at_level(logging.WARNING):
        inbox = Inbox()
        subscription = robot.create_subscription(ANGLES, "/joint_angles", inbox, largest=1 << 16)
        publisher = tool.create_publisher(ANGLES, "/joint_angles")
        matched(robot, tool, "/joint_angles")
        place = key(DOMAIN, "/joint_angles", ANGLES, tool.types.hash(ANGLES))
        for _ in range(20):
            tool.session.put(
                place, names(10_000), attachment=ATTACHED, congestion_control=zenoh.CongestionControl.BLOCK
            )
        publisher.publish(joint_names=["HeadYaw"], joint_angles=[0.1])
        assert [each.joint_names for each in inbox.wait()] == [["HeadYaw"]]
        assert subscription.malformed == 20
        assert caplog.text.count("/joint_angles: a malformed message is dropped") <= 4
        assert f"{ANGLES}: 80040 bytes; at most 65536 are decoded" in caplog.text


@pytest.fixture(scope="module")
def types() -> Types:
    return Types()


def test_a_type_of_fixed_members_has_an_exact_limit(types: Types) -> None:
    twist = types.encode(types.make("geometry_msgs/msg/Twist"))
    assert types.largest("geometry_msgs/msg/Twist") == len(twist) + 3  # padding
    with pytest.raises(MessageError, match="100 bytes; at most 55 are decoded"):
        types.decode(bytes(100), "geometry_msgs/msg/Twist")


@pytest.mark.parametrize("flag", [0, 1], ids=["big endian", "little endian"])
def test_a_list_is_counted_before_it_is_built(
    types: Types, flag: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = bytearray(names(500_000))
    data[1] = flag
    if not flag:
        data[12:16] = data[12:16][::-1]
        data[20:24] = data[20:24][::-1]
    decoding = pytest.fail
    monkeypatch.setattr(types._store, "deserialize_cdr", lambda *_: decoding("it is decoded"))
    with pytest.raises(MessageError, match="its lists have more than 50000 elements"):
        types.decode(bytes(data), ANGLES)


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("nav_msgs/msg/Path", {"poses": [{"header": {"frame_id": "odd"}}] * 1500}),
        ("sensor_msgs/msg/Image", {"data": np.arange(1 << 18, dtype=np.uint8), "encoding": "rgb8"}),
        ("tf2_msgs/msg/TFMessage", {"transforms": [{"child_frame_id": "x" * (i % 9)} for i in range(900)]}),
        (
            "trajectory_msgs/msg/JointTrajectory",
            {
                "joint_names": ["a", "bcd"],
                "points": [{"positions": [0.5] * (i % 4), "velocities": [1.0]} for i in range(1500)],
            },
        ),
        (
            "sensor_msgs/msg/PointCloud2",
            {"fields": [{"name": "x"}, {"name": "yy"}], "data": np.ones(100_001, np.uint8)},
        ),
    ],
)
def test_large_messages_are_read_whole(types: Types, name: str, fields: dict[str, Any]) -> None:
    data = types.encode(types.make(name, fields))
    assert len(data) > 50_004, "small ones are not counted"
    assert types.encode(types.decode(data, name)) == data
    with pytest.raises(MessageError):
        types.decode(data[: len(data) // 2], name)


@pytest.fixture
def watched() -> Iterator[tuple[Node, Node]]:
    with two_nodes(limits=NodeLimits(query_delay=0.1, longest_query_delay=0.2)) as nodes:
        yield nodes


def tokens(
    session: zenoh.Session, count: int, topic: str, first: int = 0, *, of: EntityKind = "MS"
) -> list[Any]:
    """Announce subscriptions, or others, that do not exist."""
    kind = f"std_msgs::msg::dds_::String_/{TEXT_HASH}/::,10:,:,:,,"
    return [
        session.liveliness().declare_token(f"@ros2_lv/{DOMAIN}/f{number:x}/0/1/{of}/%/%/n/%{topic}/{kind}")
        for number in range(first, first + count)
    ]


def test_tokens_beyond_the_most_are_counted_once_others_end(
    watched: tuple[Node, Node], caplog: pytest.LogCaptureFixture
) -> None:
    robot, tool = watched
    publisher = robot.create_publisher(TEXT, "/map", QoS(durability="transient_local"))
    assert publisher.subscribers == 0
    with caplog.at_level(logging.WARNING):
        first = tokens(tool.session, MOST_OF_A_NAME, "map")
        until(lambda: publisher.subscribers == MOST_OF_A_NAME, EVENT_LIMIT)
        others = tokens(tool.session, 40, "map", MOST_OF_A_NAME)
        until(lambda: "/map: its subscriptions: more than 256 exist" in caplog.text, EVENT_LIMIT)
        assert publisher.subscribers == MOST_OF_A_NAME
        for each in first:
            each.undeclare()
        until(lambda: publisher.subscribers == len(others), EVENT_LIMIT)
        for each in others:
            each.undeclare()
        until(lambda: publisher.subscribers == 0, EVENT_LIMIT)
    assert caplog.text.count("more than 256 exist") == 1


def test_a_sender_counts_as_gone_while_there_are_too_many(
    watched: tuple[Node, Node], caplog: pytest.LogCaptureFixture
) -> None:
    robot, tool = watched
    senders: list[Sender] = []
    robot.create_subscription(TEXT, "/a", lambda _, sender: senders.append(sender), with_sender=True)
    publisher = tool.create_publisher(TEXT, "/a")
    matched(robot, tool, "/a")
    publisher.publish(data="once")
    until(lambda: senders and not senders[0].gone)
    with caplog.at_level(logging.WARNING):
        flood = tokens(tool.session, MOST_OF_A_NAME + 1, "a", of="MP")
        until(lambda: senders[0].gone)
        what = "/a: its publishers: more than 256 exist; the others are not counted, and each counts as gone"
        until(lambda: what in caplog.text)
    for each in flood:
        each.undeclare()
    until(lambda: not senders[0].gone)


def test_subscriptions_that_end_while_they_are_asked_for_count_no_more(watched: tuple[Node, Node]) -> None:
    for number in range(repeated(3, soak=30)):  # it takes the moment
        end_while_asked_for(*watched, f"map{number}")


def end_while_asked_for(robot: Node, tool: Node, topic: str) -> None:
    announced = tokens(tool.session, MOST_OF_A_NAME, topic)
    until(lambda: len(robot.graph.entities("MS", f"/{topic}")) == MOST_OF_A_NAME)
    publisher = robot.create_publisher(TEXT, f"/{topic}")
    with ThreadPoolExecutor(1) as background:
        ends = background.submit(lambda: [each.undeclare() for each in announced])
        assert publisher.subscribers <= MOST_OF_A_NAME  # asks for them
        ends.result(EVENT_LIMIT)
    until(lambda: publisher.subscribers == 0)
    until(lambda: not robot.graph.entities("MS", f"/{topic}"))


def test_tokens_of_other_names_reach_nobody(watched: tuple[Node, Node]) -> None:
    robot, tool = watched
    publisher = robot.create_publisher(TEXT, "/map", QoS(durability="transient_local"))
    assert publisher.subscribers == 0
    others = tokens(tool.session, 300, "mapping")
    own = tokens(tool.session, 1, "map")
    until(lambda: publisher.subscribers == 1, EVENT_LIMIT)
    assert len(publisher.others.all()) == 1
    for each in [*others, *own]:
        each.undeclare()


def test_a_subscription_without_a_token_is_heard(watched: tuple[Node, Node]) -> None:
    robot, tool = watched
    publisher = robot.create_publisher(TEXT, "/a")
    assert not publisher.heard
    place = key(DOMAIN, "/a", TEXT, tool.types.hash(TEXT))
    subscriber = tool.session.declare_subscriber(place, lambda _: None)
    until(lambda: publisher.heard, EVENT_LIMIT)
    assert publisher.subscribers == 1
    subscriber.undeclare()
    until(lambda: not publisher.heard, EVENT_LIMIT)
