"""Roles in the graph of ROS: the gateway and nodes behind a router that grants rights, over real TLS links."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Any

import pytest

from interfaces.jderobot import MotorsPrx
from interfaces.nao import SafetyPrx
from plugins.ros2.tests.support.ros_lab import Lab, secured_lab
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.robot_server import eventually
from tests.support.security import Keys
from visualhfsm_ros2.gateway._command import serve
from zenoh_ros2 import LATCHED, CallError, Node

TRIGGER = "std_srvs/srv/Trigger"
TWIST = "geometry_msgs/msg/Twist"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    with secured_lab(Keys(tmp_path_factory.mktemp("keys"))) as lab:
        yield lab


def call(node: Node, name: str) -> Any:
    return node.create_client(TRIGGER, name).call(timeout=CALL_LIMIT)


def test_an_operator_commands_the_robot_over_ros_by_a_gateway_that_warns_of_nothing(
    lab: Lab, caplog: pytest.LogCaptureFixture
) -> None:
    motors = MotorsPrx.checkedCast(lab.nao.stringToProxy("Motors"))
    with lab.node("operator") as node, caplog.at_level(logging.WARNING):
        assert lab.has_topic(node, "sensor_msgs/msg/JointState", "/joint_states")
        velocity = node.create_publisher(TWIST, "/cmd_vel")
        eventually(lambda: velocity.heard)
        velocity.publish(linear={"x": 0.1})
        eventually(lambda: motors.getV() == 0.1)
        velocity.publish()
        eventually(lambda: motors.getV() == 0.0)
        assert call(node, "/nao/emergency_stop").success
        assert call(node, "/nao/reset").success
    assert "ros_serve" not in caplog.text


def test_a_student_hears_the_robot_stops_it_and_commands_nothing(lab: Lab) -> None:
    safety = SafetyPrx.checkedCast(lab.nao.stringToProxy("Safety"))
    motors = MotorsPrx.checkedCast(lab.nao.stringToProxy("Motors"))
    with lab.node("student") as node, lab.node("operator") as operator:
        assert lab.has_topic(node, "sensor_msgs/msg/JointState", "/joint_states")
        assert lab.has_topic(node, "std_msgs/msg/String", "/robot_description", LATCHED)
        assert node.graph.wait(lambda: "/nao" in node.graph.nodes(), EVENT_LIMIT)
        velocity = node.create_publisher(TWIST, "/cmd_vel")
        for _ in range(10):
            velocity.publish(linear={"x": 0.1})
        assert call(node, "/nao/emergency_stop").success
        assert safety.getSafetyState().stopped
        with pytest.raises(CallError):
            call(node, "/nao/reset")
        assert safety.getSafetyState().stopped
        assert call(operator, "/nao/reset").success
        assert motors.getV() == 0.0, "what the student sent before its calls has not arrived"


def test_a_student_serves_nothing_in_the_name_of_the_robot(lab: Lab) -> None:
    with lab.node("student") as student, lab.node("operator") as operator:
        student.create_service(TRIGGER, "/camera/reset", lambda _: {"success": True})
        with pytest.raises(CallError, match="there is no server"):
            call(operator, "/camera/reset")
        assert "/node_of_student" not in operator.graph.nodes()


def test_a_gateway_that_reaches_nobody_says_what_to_do(lab: Lab, caplog: pytest.LogCaptureFixture) -> None:
    student = lab.keys.settings("student")
    with (
        caplog.at_level(logging.WARNING),
        serve(lab.nao, "shut_out", settings=student, reach_limit=0.2),
    ):
        eventually(lambda: "needs ros_serve" in caplog.text)
    assert "/shut_out/emergency_stop" in caplog.text
    assert lab.keys.endpoint in caplog.text
