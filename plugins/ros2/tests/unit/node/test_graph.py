"""What nodes see of each other."""

from __future__ import annotations

import pytest

from plugins.ros2.tests.support.ros_nodes import two_nodes
from tests.support.limits import EVENT_LIMIT
from zenoh_ros2 import ActionServer, QoS


@pytest.mark.slow
def test_what_a_node_has_is_seen_and_goes_with_it() -> None:
    with two_nodes() as (robot, tool):
        graph = tool.graph
        scan = robot.create_publisher("sensor_msgs/msg/LaserScan", "/scan", QoS("best_effort", depth=5))
        robot.create_subscription("geometry_msgs/msg/Twist", "/cmd_vel")
        robot.create_service("std_srvs/srv/Trigger", "~/reset", lambda _: {})
        fib = ActionServer(robot, "example_interfaces/action/Fibonacci", "/fib", lambda _: None)
        assert graph.wait(lambda: "/fib" in graph.actions() and "/scan" in graph.topics(), EVENT_LIMIT)
        assert graph.nodes() == ["/robot", "/tool"]
        assert graph.topics() == {
            "/cmd_vel": ["geometry_msgs/msg/Twist"], "/scan": ["sensor_msgs/msg/LaserScan"],
        }  # fmt: skip
        assert graph.services() == {"/robot/reset": ["std_srvs/srv/Trigger"]}
        assert graph.actions() == {"/fib": ["example_interfaces/action/Fibonacci"]}
        (publisher,) = graph.entities("MP", "/scan")
        assert (publisher.node_name, publisher.qos) == ("/robot", QoS("best_effort", depth=5))
        assert publisher.type_hash == tool.types.hash("sensor_msgs/msg/LaserScan")
        scan.close()
        fib.close()
        assert graph.wait(lambda: not graph.actions() and not graph.entities("MP", "/scan"), EVENT_LIMIT)
        robot.close()
        assert graph.wait(lambda: graph.nodes() == ["/tool"], EVENT_LIMIT)


@pytest.mark.slow
def test_tokens_of_others_are_passed_over() -> None:
    with two_nodes() as (robot, tool):
        with robot.session.liveliness().declare_token(f"@ros2_lv/{robot.domain}/nonsense"):
            robot.create_client("std_srvs/srv/Empty", "/after")
            graph = tool.graph
            assert graph.wait(
                lambda: any(each.name == "/after" for each in graph.entities("SC")), EVENT_LIMIT
            )
        assert graph.nodes() == ["/robot", "/tool"]
