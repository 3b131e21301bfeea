"""Ends of topics and services that never hear each other are named, once each."""

from __future__ import annotations

import pytest

from plugins.ros2.tests.support.ros_nodes import DOMAIN, two_nodes
from tests.support.waiting import until
from zenoh_ros2 import Node
from zenoh_ros2._limits import NodeLimits
from zenoh_ros2._wire import Entity, EntityKind

TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
OWN = f"RIHS01_{'0' * 64}"
"""The hash of another definition."""


def announce(node: Node, kind: EntityKind, type_name: str, name: str, entity_id: int = 7) -> object:
    """Announce an end of another definition."""
    end = Entity(kind, DOMAIN, str(node.session.zid()), 0, entity_id, "/", "tool", name, type_name, OWN)
    return node.session.liveliness().declare_token(end.token())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("MP", "a publisher is not heard: /tool publishes"),
        ("MS", "a subscription hears nothing: /tool subscribes to"),
        ("SS", "a server is not called: /tool serves"),
        ("SC", "a client is not answered: /tool calls"),
    ],
)
def test_an_end_of_another_definition_is_named_once(
    kind: EntityKind, words: str, caplog: pytest.LogCaptureFixture
) -> None:
    with two_nodes(limits=NodeLimits(announcement=0.1)) as (robot, tool):
        type_name = "std_srvs/srv/Trigger" if kind in ("SS", "SC") else TWIST
        end: object = announce(tool, kind, type_name, "/cmd_vel")
        if kind == "MP":
            robot.create_subscription(TWIST, "/cmd_vel", besides=(TWIST, STAMPED))
        elif kind == "MS":
            robot.create_publisher(TWIST, "/cmd_vel")
        elif kind == "SS":
            robot.create_client(type_name, "/cmd_vel")
        else:
            robot.create_service(type_name, "/cmd_vel", lambda _: {})
        until(lambda: f"/cmd_vel: {words} {type_name} with the hash {OWN}" in caplog.text)
        marked = announce(tool, kind, "std_msgs/msg/String", "/cmd_vel", 8)
        until(lambda: "std_msgs/msg/String" in caplog.text)
        assert caplog.text.count(OWN) == 1
        del end, marked


@pytest.mark.slow
def test_a_node_that_hears_a_topic_by_one_of_two_subscriptions_is_not_named(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with two_nodes() as (robot, tool):
        publisher = tool.create_publisher(STAMPED, "/cmd_vel")
        for kind in (TWIST, STAMPED):
            robot.create_subscription(kind, "/cmd_vel", besides=(TWIST, STAMPED))
        until(lambda: len(publisher.others.all()) == 2)
        other = robot.create_subscription("std_msgs/msg/String", "/speech")
        tool.create_publisher(STAMPED, "/speech")
        until(lambda: "/speech: a publisher is not heard" in caplog.text)  # later than the first look
        assert publisher.subscribers == 1
        assert other.publishers == 0
    assert "/cmd_vel" not in caplog.text
