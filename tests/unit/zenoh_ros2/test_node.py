"""Publishers, subscriptions, services and clients of real nodes on loopback."""

from __future__ import annotations

import logging
import threading
from concurrent.futures import Future
from typing import Any

import pytest

from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.processes import free_endpoint
from tests.support.ros_nodes import DOMAIN, Inbox, matched, two_nodes
from tests.support.waiting import until
from zenoh_ice import Settings
from zenoh_ros2 import (
    LATCHED,
    CallError,
    CallTimeoutError,
    InvalidNameError,
    MessageError,
    Node,
    NodeClosedError,
    QoS,
    RosError,
)
from zenoh_ros2.wire import Attachment, key

ADD = "example_interfaces/srv/AddTwoInts"
TWIST = "geometry_msgs/msg/Twist"


def unanswered(robot: Node, answer: Future[object]) -> threading.Event:
    """Serve /add with a later answer; return what is set when it is asked."""
    asked = threading.Event()

    def handle(_: Any) -> Future[object]:
        asked.set()
        return answer

    robot.create_service(ADD, "/add", handle)
    return asked


def test_a_message_arrives_by_fields_and_whole() -> None:
    with two_nodes() as (robot, tool):
        inbox = Inbox()
        subscription = robot.create_subscription(TWIST, "/cmd_vel", inbox)
        publisher = tool.create_publisher(TWIST, "cmd_vel")
        matched(robot, tool, "/cmd_vel")
        assert (publisher.subscribers, subscription.publishers) == (1, 1)
        assert subscription.latest() is None
        publisher.publish(linear={"x": 0.25})
        publisher.publish(tool.types.make(TWIST, linear={"x": 0.5}))
        assert [each.linear.x for each in inbox.wait(2)] == [0.25, 0.5]
        newest = subscription.latest()
        assert newest is not None
        assert (newest.value.linear.x, newest.sequence, newest.lost) == (0.5, 2, 0)
        assert newest.age < EVENT_LIMIT


def test_next_waits_for_a_message() -> None:
    with two_nodes() as (robot, tool):
        subscription = robot.create_subscription("std_msgs/msg/String", "/a")
        publisher = tool.create_publisher("std_msgs/msg/String", "/a")
        matched(robot, tool, "/a")
        timer = threading.Timer(0.05, lambda: publisher.publish(data="now"))
        timer.start()
        assert subscription.next(EVENT_LIMIT).value.data == "now"
        timer.join()
        with pytest.raises(CallTimeoutError, match=r"/a: no message within 0.01 s"):
            subscription.next(0.01)


def test_who_joins_late_gets_the_last_messages() -> None:
    with two_nodes() as (robot, tool):
        publisher = robot.create_publisher("std_msgs/msg/String", "/map", LATCHED)
        for text in ("old", "new"):
            publisher.publish(data=text)
        inbox = Inbox()
        tool.create_subscription("std_msgs/msg/String", "/map", inbox, LATCHED)
        assert [each.data for each in inbox.wait()] == ["new"]


def test_malformed_messages_are_counted_and_named(caplog: pytest.LogCaptureFixture) -> None:
    with two_nodes() as (robot, tool), caplog.at_level(logging.WARNING):
        subscription = robot.create_subscription(TWIST, "/cmd_vel")
        publisher = tool.create_publisher(TWIST, "/cmd_vel")
        matched(robot, tool, "/cmd_vel")
        place = key(DOMAIN, "/cmd_vel", TWIST, tool.types.hash(TWIST))
        attached = Attachment(1, 0, bytes(16)).encode()
        for payload, attachment in (
            (b"", attached),
            (b"\0\1\0\0short", attached),
            (bytes(52), None),
            (b"x", b"x"),
        ):
            tool.session.put(place, payload, attachment=attachment)
        publisher.publish(linear={"x": 1.0})
        until(lambda: subscription.latest() is not None, EVENT_LIMIT)
        newest = subscription.latest()
        assert newest is not None
        assert newest.value.linear.x == 1.0
        assert subscription.malformed == 4
        assert caplog.text.count("/cmd_vel: a malformed message is dropped") == 3


def test_a_slow_callback_loses_the_oldest() -> None:
    with two_nodes() as (robot, tool):
        entered, free, end, seen = threading.Event(), threading.Event(), threading.Event(), list[int]()

        def slow(message: Any) -> None:
            entered.set()
            free.wait(CALL_LIMIT)
            seen.append(message.data)
            if message.data == 9:
                end.set()

        subscription = robot.create_subscription("std_msgs/msg/Int32", "/n", slow, QoS(depth=2))
        publisher = tool.create_publisher("std_msgs/msg/Int32", "/n")
        matched(robot, tool, "/n")
        publisher.publish(data=0)
        assert entered.wait(EVENT_LIMIT)
        for number in range(1, 10):
            publisher.publish(data=number)
        until(lambda: (newest := subscription.latest()) is not None and newest.value.data == 9, EVENT_LIMIT)
        free.set()
        assert end.wait(EVENT_LIMIT)
        assert seen == [0, 8, 9]
        assert subscription.lost == 7


def test_a_closed_subscription_calls_nobody() -> None:
    with two_nodes() as (robot, tool):
        held, go_on, seen = threading.Event(), threading.Event(), list[str]()

        def receive(message: Any) -> None:
            seen.append(message.data)
            held.set()
            go_on.wait(EVENT_LIMIT)

        subscription = robot.create_subscription("std_msgs/msg/String", "/a", receive)
        publisher = tool.create_publisher("std_msgs/msg/String", "/a")
        matched(robot, tool, "/a")
        publisher.publish(data="first")
        assert held.wait(EVENT_LIMIT)
        publisher.publish(data="second")
        until(lambda: (newest := subscription.latest()) is not None and newest.value.data == "second")
        subscription.close()
        end = threading.Event()
        subscription._line.put(end.set)  # behind the second message
        go_on.set()
        assert end.wait(EVENT_LIMIT)
        assert seen == ["first"]


def test_a_service_is_called() -> None:
    with two_nodes() as (robot, tool):
        robot.create_service(ADD, "/add", lambda request: {"sum": request.a + request.b})
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        assert client.call(a=40, b=2, timeout=CALL_LIMIT).sum == 42
        assert client.call_async({"a": 1, "b": 2}).result(CALL_LIMIT).sum == 3


def test_a_service_may_answer_later() -> None:
    with two_nodes() as (robot, tool):
        later: Future[object] = Future()
        asked = unanswered(robot, later)
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        response = client.call_async(a=1, b=1)
        assert asked.wait(EVENT_LIMIT)
        assert not response.done()
        later.set_result({"sum": 7})
        assert response.result(CALL_LIMIT).sum == 7


@pytest.mark.parametrize(
    ("handler", "why"),
    [
        (lambda _: 1 // 0, "the handler failed: ZeroDivisionError"),
        (lambda _: {"sum": "much"}, r"AddTwoInts_Response\.sum: a whole number"),
        (lambda _: 5, "this is a int"),
    ],
)
def test_a_failing_service_is_an_error_of_its_caller(handler: Any, why: str) -> None:
    with two_nodes() as (robot, tool):
        robot.create_service(ADD, "/add", handler)
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        with pytest.raises(CallError, match=why):
            client.call(a=1, b=2, timeout=CALL_LIMIT)


def test_a_malformed_request_is_refused_and_counted() -> None:
    with two_nodes() as (robot, tool):
        service = robot.create_service(ADD, "/add", lambda request: {"sum": request.a})
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        place = key(DOMAIN, "/add", ADD, tool.types.hash(ADD))
        attached = Attachment(1, 0, bytes(16)).encode()
        for payload, attachment in ((b"\0\1\0\0xy", attached), (bytes(20), None), (bytes(5 << 20), attached)):
            replies = [*tool.session.get(place, payload=payload, attachment=attachment, timeout=CALL_LIMIT)]
            assert [each.ok for each in replies] == [None]
        assert service.malformed == 3
        assert client.call(a=1, b=2, timeout=CALL_LIMIT).sum == 1


def test_calls_without_a_server_end() -> None:
    with two_nodes() as (_, tool):
        client = tool.create_client(ADD, "/nowhere")
        with pytest.raises(CallError, match="/nowhere: there is no server"):
            client.call(timeout=CALL_LIMIT)
        with pytest.raises(CallTimeoutError, match=r"/nowhere: no server within 0\.05 s"):
            client.wait(0.05)


def test_a_call_ends_when_its_limit_has_passed_and_when_the_node_closes() -> None:
    with two_nodes() as (robot, tool):
        never: Future[object] = Future()
        robot.create_service(ADD, "/add", lambda _: never)
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        with pytest.raises(CallTimeoutError, match="/add: no response"):
            client.call(timeout=0.2)
        pending = client.call_async()
        tool.close()
        with pytest.raises(NodeClosedError, match="closed during the call"):
            pending.result(CALL_LIMIT)
        never.cancel()


def test_a_call_ends_with_its_server() -> None:
    with two_nodes() as (robot, tool):
        asked = unanswered(robot, Future())
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        pending = client.call_async()
        assert asked.wait(EVENT_LIMIT)
        robot.close()
        with pytest.raises(CallError):
            pending.result(CALL_LIMIT)


def test_the_first_of_two_servers_answers_a_call() -> None:
    with two_nodes() as (robot, tool):
        silent: Future[object] = Future()
        asked = unanswered(robot, silent)
        tool.create_service(ADD, "/add", lambda request: {"sum": request.a + request.b})
        client = tool.create_client(ADD, "/add")
        assert tool.graph.wait(lambda: len(tool.graph.servers("/add")) == 2, EVENT_LIMIT)
        assert client.call_async(a=1, b=2).result(CALL_LIMIT).sum == 3
        assert client.call(a=2, b=2, timeout=CALL_LIMIT).sum == 4
        assert asked.wait(EVENT_LIMIT)
        assert not silent.done()
        silent.set_result({})


def test_a_call_that_its_caller_gave_up_ends_no_thread(caplog: pytest.LogCaptureFixture) -> None:
    with two_nodes() as (robot, tool):
        answer: Future[object] = Future()
        asked = unanswered(robot, answer)
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        future = client.call_async(a=1, b=2)
        assert asked.wait(EVENT_LIMIT)
        assert future.cancel()
        answer.set_result({"sum": 3})
        assert client.call_async(a=1, b=2).result(CALL_LIMIT).sum == 3
    assert "failed" not in caplog.text


def test_names_are_remapped_and_relative_to_the_namespace() -> None:
    with two_nodes(namespace="/red", remap={"cmd_vel": "/base/cmd_vel"}) as (robot, tool):
        subscription = robot.create_subscription(TWIST, "cmd_vel")
        publisher = tool.create_publisher(TWIST, "/base/cmd_vel")
        assert subscription.name == "/base/cmd_vel"
        assert robot.resolve("scan") == "/red/scan"
        assert robot.full_name == "/red/robot"
        matched(robot, tool, "/base/cmd_vel")
        publisher.publish()


def test_what_does_not_fit_is_never_sent() -> None:
    with two_nodes() as (_, tool):
        publisher = tool.create_publisher(TWIST, "/cmd_vel")
        with pytest.raises(MessageError, match="there is no field 'speed'"):
            publisher.publish(speed=1)
        publisher.close()
        with pytest.raises(NodeClosedError):
            publisher.publish()
        tool.close()
        with pytest.raises(NodeClosedError, match="node /tool is closed"):
            tool.create_publisher(TWIST, "/cmd_vel")


def test_bad_names_and_domains_open_no_session(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InvalidNameError, match="node '1'"):
        Node("1")
    monkeypatch.setenv("ROS_DOMAIN_ID", "lab")
    with pytest.raises(RosError, match="domain 'lab'"):
        Node("nao")


def test_the_domain_is_that_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "42")
    with Node("nao", settings=Settings(connect=())) as node:
        assert node.domain == 42
        assert node.time(1_500_000_000).nanosec == 500_000_000


def test_a_node_without_a_router_says_so(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("zenoh_ros2.absence.PATIENCE", 0.2)
    endpoint = free_endpoint()
    with Node("alone", settings=Settings(connect=(endpoint,)), domain=DOMAIN) as node:
        assert not node.connected
        until(lambda: f"nothing of ROS answers at {endpoint} so far" in caplog.text)


def test_a_node_whose_router_starts_after_it_says_nothing(caplog: pytest.LogCaptureFixture) -> None:
    endpoint = free_endpoint()
    with (
        Node("early", settings=Settings(connect=(endpoint,)), domain=DOMAIN) as early,
        Node("late", settings=Settings(listen=(endpoint,), connect=()), domain=DOMAIN) as late,
    ):
        until(lambda: early.connected and late.connected)
    assert "nothing of ROS answers" not in caplog.text


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
