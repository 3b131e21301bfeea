"""What is assigned to a message arrives as the same values given as fields do, by every door of a node."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from plugins.ros2.tests.support.ros_nodes import Inbox, matched, two_nodes
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.waiting import until
from zenoh_ros2 import LATCHED, ActionClient, ActionServer, MessageError, Node, QoS, ServerGoal, Types

STATE, GET = "sensor_msgs/msg/JointState", "rcl_interfaces/srv/GetParameters"
FIBONACCI = "example_interfaces/action/Fibonacci"
WHOLE = np.array([1, 2])  # of int64, where a message has another type
Pair = tuple[Node, Node]


@pytest.fixture(scope="module")
def nodes() -> Iterator[Pair]:
    with two_nodes() as pair:
        yield pair


def assigned(types: Types, name: str, **values: object) -> Any:
    """Return a message to which values were assigned."""
    message = types.make(name)
    for field, value in values.items():
        setattr(message, field, value)
    return message


@pytest.mark.parametrize("qos", [QoS(), LATCHED], ids=["volatile", "latched"])
def test_a_published_message(nodes: Pair, qos: QoS) -> None:
    robot, tool = nodes
    topic, inbox = f"/joints/{qos.durability}", Inbox()
    robot.create_subscription(STATE, topic, inbox, qos)
    publisher = tool.create_publisher(STATE, topic, qos)
    matched(robot, tool, topic)
    publisher.publish(assigned(tool.types, STATE, position=WHOLE, effort=np.array([0.5], ">f8")))
    (read,) = inbox.wait()
    assert (read.position.tolist(), read.effort.tolist()) == ([1.0, 2.0], [0.5])
    with pytest.raises(MessageError, match=r"JointState\.position: a sequence of float64"):
        publisher.publish(assigned(tool.types, STATE, position=np.array(["far"])))


def test_a_request_and_a_response(nodes: Pair) -> None:
    robot, tool = nodes

    def answer(request: Any) -> Any:
        value = assigned(robot.types, "rcl_interfaces/msg/ParameterValue", double_array_value=WHOLE)
        return assigned(robot.types, f"{GET}_Response", values=[value] * len(request.names))

    robot.create_service(GET, "/get", answer)
    client = tool.create_client(GET, "/get")
    client.wait(EVENT_LIMIT)
    request = assigned(tool.types, f"{GET}_Request", names=np.array(["a"]))
    (value,) = client.call(request, timeout=CALL_LIMIT).values
    assert value.double_array_value.tolist() == [1.0, 2.0]


def test_a_goal_its_feedback_and_its_result(nodes: Pair) -> None:
    robot, tool = nodes

    def execute(goal: ServerGoal) -> Any:
        goal.publish_feedback(assigned(robot.types, f"{FIBONACCI}_Feedback", sequence=WHOLE))
        goal.wait(CALL_LIMIT)
        return assigned(robot.types, f"{FIBONACCI}_Result", sequence=np.full(goal.request.order, 7, ">i8"))

    server = ActionServer(robot, FIBONACCI, "/count", execute)
    client = ActionClient(tool, FIBONACCI, "/count")
    client.wait(EVENT_LIMIT)
    until(lambda: bool(tool.graph.entities("MP", "/count/_action/feedback")))
    goal = client.send(assigned(tool.types, f"{FIBONACCI}_Goal", order=np.uint8(3)), timeout=CALL_LIMIT)
    until(lambda: goal.feedback is not None)
    assert goal.feedback.sequence.tolist() == [1, 2]
    goal.cancel(CALL_LIMIT)
    assert goal.result(CALL_LIMIT).sequence.tolist() == [7, 7, 7]
    server.close()
