"""Nodes: their names, domains and router."""

from __future__ import annotations

import pytest

from plugins.ros2.tests.support.ros_nodes import DOMAIN, matched, two_nodes
from tests.support.limits import EVENT_LIMIT
from tests.support.processes import free_endpoint
from tests.support.waiting import until
from zenoh_ice import Settings
from zenoh_ros2 import InvalidNameError, MessageError, Node, NodeClosedError, RosError
from zenoh_ros2._limits import NodeLimits

pytestmark = pytest.mark.slow

TWIST = "geometry_msgs/msg/Twist"


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


@pytest.mark.slow
def test_a_node_without_a_router_says_so(caplog: pytest.LogCaptureFixture) -> None:
    endpoint, brief = free_endpoint(), NodeLimits(first_link=0.2)
    with Node("alone", settings=Settings(connect=(endpoint,)), domain=DOMAIN, limits=brief) as node:
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


def fail() -> None:
    raise ZeroDivisionError


def test_a_node_closes_all_of_it_even_if_a_part_fails_to_close() -> None:
    with two_nodes() as (robot, tool):
        robot.create_publisher(TWIST, "/cmd_vel")
        robot.on_close("part", fail)
        with pytest.raises(ZeroDivisionError):
            robot.close()
        assert tool.graph.wait(lambda: robot.full_name not in tool.graph.nodes(), EVENT_LIMIT)
        assert not tool.graph.topics()
