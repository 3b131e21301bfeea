"""Publishers and subscriptions of real nodes on loopback."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from plugins.ros2.tests.support.ros_nodes import Inbox, matched, two_nodes
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, RUN_LIMIT
from tests.support.waiting import until
from zenoh_ros2 import LATCHED, CallTimeoutError, Node, NodeClosedError, QoS

pytestmark = pytest.mark.slow

TWIST = "geometry_msgs/msg/Twist"
Pair = tuple[Node, Node]


def test_a_message_arrives_by_fields_and_whole(nodes: Pair, name: str) -> None:
    robot, tool = nodes
    inbox = Inbox()
    subscription = robot.create_subscription(TWIST, name, inbox)
    publisher = tool.create_publisher(TWIST, name.removeprefix("/"))
    matched(robot, tool, name)
    until(lambda: (publisher.subscribers, subscription.publishers) == (1, 1))
    assert subscription.latest() is None
    began = time.monotonic()
    publisher.publish(linear={"x": 0.25})
    publisher.publish(tool.types.make(TWIST, linear={"x": 0.5}))
    assert [each.linear.x for each in inbox.wait(2)] == [0.25, 0.5]
    newest = subscription.latest()
    assert newest is not None
    assert (newest.value.linear.x, newest.sequence, newest.lost) == (0.5, 2, 0)
    assert 0.0 <= newest.age <= time.monotonic() - began


def test_next_waits_for_a_message(nodes: Pair, name: str) -> None:
    robot, tool = nodes
    subscription = robot.create_subscription("std_msgs/msg/String", name)
    publisher = tool.create_publisher("std_msgs/msg/String", name)
    matched(robot, tool, name)
    timer = threading.Timer(0.05, lambda: publisher.publish(data="now"))
    timer.start()
    assert subscription.next(EVENT_LIMIT).value.data == "now"
    timer.join()
    with pytest.raises(CallTimeoutError, match=rf"{name}: no message within 0.01 s"):
        subscription.next(0.01)


def test_who_joins_late_gets_the_last_messages(nodes: Pair, name: str) -> None:
    robot, tool = nodes
    publisher = robot.create_publisher("std_msgs/msg/String", name, LATCHED)
    for text in ("old", "new"):
        publisher.publish(data=text)
    inbox = Inbox()
    tool.create_subscription("std_msgs/msg/String", name, inbox, LATCHED)
    assert [each.data for each in inbox.wait()] == ["new"]


def test_what_was_kept_for_who_joins_late_ends_with_its_publisher(nodes: Pair, name: str) -> None:
    robot, tool = nodes
    gone, kept = (robot.create_publisher("std_msgs/msg/String", name, LATCHED) for _ in range(2))
    gone.publish(data="gone")
    gone.close()
    kept.publish(data="kept")
    inbox = Inbox()
    tool.create_subscription("std_msgs/msg/String", name, inbox, LATCHED)
    assert [each.data for each in inbox.wait()] == ["kept"]


CLOSED_WHILE_TOKENS_ARE_ASKED_FOR = """
import threading
from zenoh.handlers import Callback
from plugins.ros2.tests.support.ros_nodes import two_nodes
from zenoh_ros2 import LATCHED

with two_nodes() as (robot, _):
    liveliness, ended = robot.session.liveliness(), threading.Event()

    def ask():
        while not ended.is_set():
            liveliness.get("**", handler=Callback(print, lambda: None, indirect=False))

    asking = threading.Thread(target=ask)
    asking.start()
    for number in range(100):
        robot.create_subscription("std_msgs/msg/String", f"/a{number}", print, LATCHED).close()
        robot.create_publisher("std_msgs/msg/String", f"/a{number}", LATCHED).close()
    ended.set()
    asking.join()
"""


def test_a_publisher_is_closed_while_others_ask_for_tokens() -> None:
    """Where that ends in a deadlock, no other thread of the process runs any more."""
    command = [sys.executable, "-c", CLOSED_WHILE_TOKENS_ARE_ASKED_FOR]
    assert subprocess.run(command, stdout=subprocess.DEVNULL, timeout=RUN_LIMIT, check=False).returncode == 0


def test_a_slow_callback_loses_the_oldest(nodes: Pair, name: str) -> None:
    robot, tool = nodes
    entered, free, end, seen = threading.Event(), threading.Event(), threading.Event(), list[int]()

    def slow(message: Any) -> None:
        entered.set()
        free.wait(CALL_LIMIT)
        seen.append(message.data)
        if message.data == 9:
            end.set()

    subscription = robot.create_subscription("std_msgs/msg/Int32", name, slow, QoS(depth=2))
    publisher = tool.create_publisher("std_msgs/msg/Int32", name)
    matched(robot, tool, name)
    publisher.publish(data=0)
    assert entered.wait(EVENT_LIMIT)
    for number in range(1, 10):
        publisher.publish(data=number)
    until(lambda: (newest := subscription.latest()) is not None and newest.value.data == 9, EVENT_LIMIT)
    free.set()
    assert end.wait(EVENT_LIMIT)
    assert seen == [0, 8, 9]
    assert subscription.lost == 7


def test_a_closed_subscription_calls_nobody(nodes: Pair, name: str) -> None:
    robot, tool = nodes
    held, go_on, seen = threading.Event(), threading.Event(), list[str]()

    def receive(message: Any) -> None:
        seen.append(message.data)
        held.set()
        go_on.wait(EVENT_LIMIT)

    subscription = robot.create_subscription("std_msgs/msg/String", name, receive)
    publisher = tool.create_publisher("std_msgs/msg/String", name)
    matched(robot, tool, name)
    publisher.publish(data="first")
    assert held.wait(EVENT_LIMIT)
    publisher.publish(data="second")
    until(lambda: (newest := subscription.latest()) is not None and newest.value.data == "second")
    subscription.close()
    go_on.set()
    until(lambda: not subscription._line._running)  # the second message has had its turn
    assert seen == ["first"]


def test_publishers_that_a_subscription_cannot_hear_are_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    with two_nodes() as (robot, tool):
        plain, stamped = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
        robot.create_subscription(plain, "/cmd_vel", besides=(stamped,))
        for kind in (plain, stamped, "geometry_msgs/msg/Pose"):
            tool.create_publisher(kind, "/cmd_vel")
        expected = "/cmd_vel: a publisher is not heard: /tool publishes geometry_msgs/msg/Pose, geometry_msgs/msg/Twist is"
        until(lambda: expected in caplog.text)
        robot.types.add("peer_msgs/msg/Ball", "float64 size\n")
        tool.types.add("peer_msgs/msg/Ball", "float64 size\nstring color\n")
        robot.create_subscription("peer_msgs/msg/Ball", "/ball")
        tool.create_publisher("peer_msgs/msg/Ball", "/ball")
        until(lambda: "/tool publishes peer_msgs/msg/Ball with the hash RIHS01_" in caplog.text)
    assert caplog.text.count("is not heard") == 2


def test_a_publisher_is_closed_while_it_publishes() -> None:
    def publish() -> None:
        while True:
            publisher.publish(data="x" * 1_000_000)
            began.set()

    with two_nodes() as (robot, _), ThreadPoolExecutor(1) as background:
        for number in range(10):
            publisher, began = (
                robot.create_publisher("std_msgs/msg/String", f"/a{number}", LATCHED),
                threading.Event(),
            )
            published = background.submit(publish)
            assert began.wait(EVENT_LIMIT)
            publisher.close()
            assert isinstance(published.exception(EVENT_LIMIT), NodeClosedError)
