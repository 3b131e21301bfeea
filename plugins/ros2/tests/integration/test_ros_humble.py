"""Nodes of Humble, which write no type hashes, beside those of a later distribution: ours serve both at once.

A genuine rmw_zenoh cannot be had without ROS. The nodes here have its session settings, keys, tokens and attachments,
and the bytes of Humble, which test_codec.py compares with rosbags' definitions of that distribution.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest

from interfaces.jderobot import MotorsPrx
from naoserver.bodies.nao import H25
from naoserver.fake import FakeRobot
from plugins.ros2.tests.integration.test_ros2_gateway import gateway
from plugins.ros2.tests.support.rmw_zenoh import GenuineNode
from plugins.ros2.tests.support.ros_nodes import Inbox
from plugins.ros2.tests.support.ros_strangers import Stranger
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.processes import free_endpoint
from tests.support.robot_server import eventually
from tests.support.security import routing
from tests.support.waiting import until
from zenoh_ice import RobotClock, Settings
from zenoh_ros2 import LATCHED, ActionServer, Node, Parameters, QoS, Status, Types
from zenoh_ros2._wire import HASHLESS, key

TEXT, TRIGGER, ADD = "std_msgs/msg/String", "std_srvs/srv/Trigger", "example_interfaces/srv/AddTwoInts"
FIBONACCI, RANGE = "example_interfaces/action/Fibonacci", "sensor_msgs/msg/Range"
GET = "rcl_interfaces/srv/GetParameters"
PLAY = "naoqi_bridge_msgs/action/RunBehavior"


@contextmanager
def router() -> Iterator[str]:
    """Run a router; yield its endpoint."""
    endpoint = free_endpoint()
    with routing(Settings(mode="router", listen=(endpoint,))):
        yield endpoint


def strangers(endpoint: str, opened: ExitStack) -> list[Stranger]:
    """Return a node of Humble and one of Jazzy."""
    return [
        Stranger(opened.enter_context(GenuineNode(name, endpoint)), Types("jazzy"), humble=name == "humble")
        for name in ("humble", "jazzy")
    ]


@pytest.fixture(scope="module")
def met() -> Iterator[tuple[Node, Node, list[Stranger]]]:
    """Two nodes of ours, one of Humble and one of Jazzy, at a router."""
    with router() as endpoint, ExitStack() as opened:
        settings = Settings(connect=(endpoint,), listen=("tcp/127.0.0.1:0",))
        ours, other = (
            opened.enter_context(Node(name, settings=settings, domain=0)) for name in ("ours", "other")
        )
        yield ours, other, strangers(endpoint, opened)


Met = tuple[Node, Node, list[Stranger]]


def test_messages_of_ours_come_once_to_everybody(met: Met) -> None:
    ours, other, outside = met
    inbox = Inbox()
    other.create_subscription(RANGE, "/sonar", inbox, QoS(depth=100))
    heard = [each.listen(RANGE, "/sonar") for each in outside]
    publisher = ours.create_publisher(RANGE, "/sonar")
    until(lambda: publisher.subscribers == 3)
    sent = [number / 8 for number in range(20)]
    for distance in sent:
        publisher.publish(range=distance, variance=0.5)
    until(lambda: all(len(each()) == len(sent) for each in heard))
    publisher.publish(range=9.0)
    until(lambda: inbox.messages and inbox.messages[-1].range == 9.0)
    assert [each.range for each in inbox.messages] == [*sent, 9.0]
    for each, variance in zip(heard, (0.0, 0.5), strict=True):
        assert [(message.range, message.variance) for message in each()[: len(sent)]] == [
            (distance, variance) for distance in sent
        ]


def test_messages_of_both_are_heard(met: Met) -> None:
    ours, _, outside = met
    inbox = Inbox()
    subscription = ours.create_subscription(RANGE, "/sonars", inbox, QoS(depth=100))
    publishers = [each.publisher(RANGE, "/sonars") for each in outside]
    until(
        lambda: subscription.publishers == len(publishers) and all(each.node.is_heard() for each in outside)
    )
    for number in range(10):
        for publish in publishers:
            publish(range=float(number), variance=0.5)
    assert sorted((each.range, each.variance) for each in inbox.wait(count=20)) == [
        (float(number), variance) for number in range(10) for variance in (0.0, 0.5)
    ]


def test_nothing_is_sent_twice_while_nobody_of_humble_listens(met: Met) -> None:
    ours, other, outside = met
    inbox = Inbox()
    heard: list[bytes] = []
    other.create_subscription(TEXT, "/chatter", inbox, QoS(depth=100))
    jazzy = outside[1].listen(TEXT, "/chatter")
    unannounced = ours.session.declare_subscriber(
        key(0, "/chatter", TEXT, HASHLESS), lambda sample: heard.append(sample.payload.to_bytes())
    )
    publisher = ours.create_publisher(TEXT, "/chatter")
    until(lambda: publisher.subscribers == 2)
    for number in range(10):
        publisher.publish(data=str(number))
    until(lambda: len(jazzy()) == 10)
    assert [each.data for each in inbox.wait(count=10)] == [str(number) for number in range(10)]
    assert not heard
    unannounced.undeclare()


def test_late_subscriptions_of_both_get_what_is_latched(met: Met) -> None:
    ours, other, outside = met
    publisher = ours.create_publisher(TEXT, "/map", QoS(durability="transient_local", depth=3))
    early = outside[1].listen(TEXT, "/map")
    until(lambda: publisher.subscribers == 1)
    for number in range(5):
        publisher.publish(data=str(number))
    until(lambda: len(early()) == 5)  # Zenoh may not send what is still under way
    late = [each.listen(TEXT, "/map", QoS(durability="transient_local", depth=3)) for each in outside]
    inbox = Inbox()
    other.create_subscription(TEXT, "/map", inbox, QoS(durability="transient_local", depth=3))
    until(lambda: all([each.data for each in heard()] == ["2", "3", "4"] for heard in late))
    inbox.wait(count=3)
    publisher.publish(data="end")
    until(lambda: inbox.messages[-1].data == "end")
    assert [each.data for each in inbox.messages] == ["2", "3", "4", "end"]


def test_services_actions_and_parameters_are_called_from_both(met: Met) -> None:
    ours, _, outside = met
    ours.create_service(ADD, "/add", lambda request: {"sum": request.a + request.b})
    Parameters(ours).declare("speed", 0.5)
    ActionServer(ours, FIBONACCI, "/count", lambda goal: {"sequence": [goal.request.order]})
    for each in outside:
        call = ready(each.client(ADD, "/add"), a=0, b=0)
        assert call(CALL_LIMIT, a=2, b=3).sum == 5
        (value,) = each.client(GET, "/ours/get_parameters")(CALL_LIMIT, names=["speed"]).values
        assert value.double_value == 0.5
        goal = {"goal_id": {"uuid": bytes(range(16)) if each.humble else bytes(16)}}
        sent = each.client(f"{FIBONACCI}_SendGoal", "/count/_action/send_goal")
        assert sent(CALL_LIMIT, **goal, goal={"order": 7}).accepted
        ended = each.client(f"{FIBONACCI}_GetResult", "/count/_action/get_result")(CALL_LIMIT, **goal)
        assert (ended.status, list(ended.result.sequence)) == (Status.SUCCEEDED, [7])


def test_services_of_both_are_called(met: Met) -> None:
    ours, _, outside = met
    for number, each in enumerate(outside):
        each.serve(ADD, f"/add{number}", lambda request: {"sum": request.a + request.b})
        client = ours.create_client(ADD, f"/add{number}")
        client.wait(EVENT_LIMIT)
        assert client.call(a=20, b=22, timeout=CALL_LIMIT).sum == 42


def test_sizes_are_checked_before_messages_of_both_are_decoded(met: Met) -> None:
    ours, _, outside = met
    subscription = ours.create_subscription(TEXT, "/small", largest=100)
    served = ours.create_service("rcl_interfaces/srv/ListParameters", "/list", lambda _: {}, largest=100)
    for number, each in enumerate(outside, 1):
        publish = each.publisher(TEXT, "/small")
        until(lambda number=number: subscription.publishers == number)  # type: ignore[misc]
        publish(data="x" * 1000)
        call = each.node.client(served.type_name, each.hash(served.type_name), "/list")
        with pytest.raises(AssertionError):
            call(bytes.fromhex("00010000") + bytes(1000), CALL_LIMIT)
        until(lambda number=number: (subscription.malformed, served.malformed) == (number, number))  # type: ignore[misc]
    assert subscription.latest() is None


def ready(call: Callable[..., Any], **fields: Any) -> Callable[..., Any]:
    """Wait until a service answers a stranger; return what calls it."""

    def answers() -> bool:
        try:
            call(CALL_LIMIT, **fields)
        except ValueError:  # nobody replies yet
            return False
        return True

    eventually(answers)
    return call


class Visitor:
    """What a node of one distribution has of the robot: all kinds of topics, services and an action."""

    def __init__(self, stranger: Stranger) -> None:
        self.states = stranger.listen("sensor_msgs/msg/JointState", "/joint_states")
        self.sonar = stranger.listen(RANGE, "/sonar/left")
        self.images = stranger.listen("sensor_msgs/msg/Image", "/camera/front/image_raw")
        self.description = stranger.listen(TEXT, "/robot_description", LATCHED)
        self.clock = stranger.listen("rosgraph_msgs/msg/Clock", "/clock")
        self.drive = stranger.publisher("geometry_msgs/msg/Twist", "/cmd_vel")
        self.reset = stranger.client(TRIGGER, "/nao/reset")
        self.parameters = stranger.client(GET, "/nao/get_parameters")
        self.send = stranger.client(f"{PLAY}_SendGoal", "/run_behavior/_action/send_goal")
        self.cancel = stranger.client("action_msgs/srv/CancelGoal", "/run_behavior/_action/cancel_goal")
        self.result = stranger.client(f"{PLAY}_GetResult", "/run_behavior/_action/get_result")

    def use(self, motors: MotorsPrx) -> None:
        """Check that each of them works, both ways."""
        eventually(lambda: all(heard() for heard in (self.states, self.sonar, self.images, self.description)))
        eventually(lambda: self.clock() and self.clock()[-1].clock.nanosec != self.clock()[0].clock.nanosec)
        assert len(self.states()[-1].name) == len(self.states()[-1].position) == len(H25.joint_names)
        assert self.description()[0].data.startswith("<?xml")
        assert ready(self.reset)(CALL_LIMIT).success
        (simulated,) = self.parameters(CALL_LIMIT, names=["use_sim_time"]).values
        assert (simulated.type, simulated.bool_value) == (1, True)
        eventually(lambda: (self.drive(linear={"x": 0.1}), motors.getV() == pytest.approx(0.1))[1])
        eventually(lambda: motors.getV() == 0.0)
        goal = {"goal_id": {"uuid": random.randbytes(16)}}
        assert self.send(CALL_LIMIT, **goal, goal={"behavior": "wave"}).accepted
        assert self.cancel(CALL_LIMIT, goal_info=goal).goals_canceling
        assert self.result(CALL_LIMIT, **goal).status == Status.CANCELED


def check_a_start(order: Sequence[str]) -> None:
    """Start a gateway and the nodes in an order, and use the robot from each node."""
    with router() as endpoint, ExitStack() as opened:
        visitors: list[Visitor] = []
        for each in order:
            if each == "gateway":
                clock = RobotClock(0.0, 1.0, simulated=True, silence=math.inf)
                robot = opened.enter_context(gateway(FakeRobot(clock), router=endpoint))
            else:
                node = opened.enter_context(GenuineNode(each, endpoint))
                visitors.append(Visitor(Stranger(node, Types("jazzy"), humble=each == "humble")))
        for visitor in visitors:
            visitor.use(robot.nao.proxy(MotorsPrx, "Motors"))


def test_one_gateway_serves_nodes_of_humble_and_of_jazzy() -> None:
    check_a_start(["humble", "gateway", "jazzy"])


@pytest.mark.soak(
    "plugins/ros2/tests/integration/test_ros_humble.py::test_one_gateway_serves_nodes_of_humble_and_of_jazzy"
)
@pytest.mark.parametrize("number", range(20))
def test_the_gateway_serves_both_in_any_order_of_starts(number: int) -> None:
    order = ["humble", "gateway", "jazzy"]
    random.Random(number).shuffle(order)
    check_a_start(order)


@pytest.mark.parametrize("distribution", ["humble", "lyrical"])
def test_the_gateway_starts_where_a_distribution_is_sourced(
    distribution: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DISTRO", distribution)
    with gateway() as robot:
        assert robot.ros.create_client(TRIGGER, "/nao/reset").call(timeout=CALL_LIMIT).success
