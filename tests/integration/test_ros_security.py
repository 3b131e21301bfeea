"""Roles in the graph of ROS: the gateway and nodes behind a router that grants rights, over real TLS links."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from typing import Any

import pytest

from interfaces.jderobot import MotorsPrx
from interfaces.nao import SafetyPrx
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.ros2._command import serve
from naoserver.ros2._telemetry import Telemetry
from naoserver.server import serve as serve_robot
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.robot_server import eventually
from tests.support.security import Keys, routing
from zenoh_ice import Communicator, initialize
from zenoh_ice.limits import Limits
from zenoh_ros2 import LATCHED, CallError, Node, QoS, settings_of_node

TRIGGER = "std_srvs/srv/Trigger"
TWIST = "geometry_msgs/msg/Twist"
HISTORY = QoS(durability="transient_local", depth=10)


@dataclass
class Lab:
    """A robot behind a secured router, a native client of it, and the gateway of an operator."""

    keys: Keys
    nao: Communicator
    telemetry: Telemetry

    @contextmanager
    def node(self, user: str) -> Iterator[Node]:
        """Open a node of ROS of a user."""
        with Node(f"node_of_{user}", settings=settings_of_node(self.keys.settings(user))) as node:
            yield node

    def has_topic(self, node: Node, type_name: str, name: str, qos: QoS = QoS()) -> bool:  # noqa: B008
        """Wait for a message of a topic, and return whether one came."""
        subscription = node.create_subscription(type_name, name, qos=qos)

        def came() -> bool:
            self.telemetry.look()
            return subscription.latest() is not None

        eventually(came)
        return came()


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    keys = Keys(tmp_path_factory.mktemp("keys"))
    patient = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
    with ExitStack() as steps:
        enter = steps.enter_context
        enter(routing(keys.settings("router")))
        robot = enter(closing(FakeRobot()))
        adapter = enter(initialize(keys.settings("robot"))).createObjectAdapter("Robot")
        robot.start()
        enter(serve_robot(robot, adapter, patient))
        adapter.activate()
        # It looks half a second for parts that the robot does not have, and no longer for long calls.
        brief = Limits(longest_grace=0.0)
        operator = enter(initialize(keys.settings("operator"), limits=brief))
        eventually(lambda: "Safety" in operator.identities())
        telemetry = enter(serve(operator, "nao", settings=keys.settings("operator")))
        yield Lab(keys, operator, telemetry)


def call(node: Node, name: str) -> Any:
    return node.create_client(TRIGGER, name).call(timeout=CALL_LIMIT)


def test_an_operator_commands_the_robot_over_ros(lab: Lab) -> None:
    motors = MotorsPrx.checkedCast(lab.nao.stringToProxy("Motors"))
    with lab.node("operator") as node:
        assert lab.has_topic(node, "sensor_msgs/msg/JointState", "/joint_states")
        velocity = node.create_publisher(TWIST, "/cmd_vel")
        eventually(lambda: velocity.heard)
        velocity.publish(linear={"x": 0.1})
        eventually(lambda: motors.getV() == 0.1)
        velocity.publish()
        eventually(lambda: motors.getV() == 0.0)
        assert call(node, "/nao/emergency_stop").success
        assert call(node, "/nao/reset").success


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


def test_a_gateway_that_is_reached_warns_of_nothing(lab: Lab, caplog: pytest.LogCaptureFixture) -> None:
    with lab.node("operator") as node, caplog.at_level(logging.WARNING):
        assert call(node, "/nao/emergency_stop").success
        assert call(node, "/nao/reset").success
    assert "ros_serve" not in caplog.text
