"""A secured lab with ROS: a robot and its gateway behind a router that grants rights, over real TLS links."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass

from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.serving.server import serve as serve_robot
from tests.support.limits import FOREVER
from tests.support.robot_server import eventually
from tests.support.security import Keys, routing
from visualhfsm_ros2.gateway._command import serve
from visualhfsm_ros2.gateway._telemetry import Telemetry
from zenoh_ice import Communicator, initialize
from zenoh_ice.threads.limits import Limits
from zenoh_ros2 import Node, QoS, settings_of_node

__all__ = ["Lab", "secured_lab"]


@dataclass
class Lab:
    """A robot behind a secured router, a native client of it, and its gateway."""

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
            self.telemetry.poll()
            return subscription.latest() is not None

        eventually(came)
        return came()


@contextmanager
def secured_lab(
    keys: Keys, namespace: str = "/", gateway: str = "gateway", realm: str = "nao", **router: object
) -> Iterator[Lab]:
    """Run a router with some settings, a fake robot, whose walk goes on for long, and its gateway."""
    patient = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
    with ExitStack() as steps:
        enter = steps.enter_context
        enter(routing(keys.settings("router", **router)))
        robot = enter(closing(FakeRobot()))
        adapter = enter(initialize(keys.settings("robot", realm=realm))).createObjectAdapter("Robot")
        robot.start()
        enter(serve_robot(robot, adapter, patient))
        adapter.activate()
        # It looks half a second for parts that the robot does not have, and no longer for long calls.
        brief = Limits(longest_grace=0.0)
        operator = enter(initialize(keys.settings("operator", realm=realm)))
        own = keys.settings(gateway, realm=realm)
        client = enter(initialize(own, limits=brief))
        eventually(lambda: "Safety" in client.identities())
        telemetry = enter(serve(client, "nao", settings=own, namespace=namespace))
        yield Lab(keys, operator, telemetry)
