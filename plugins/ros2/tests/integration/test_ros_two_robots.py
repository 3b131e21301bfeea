"""Two robots in one graph of ROS: each has its own time and its own frames."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from interfaces.jderobot import MotorsPrx
from interfaces.nao import WalkPrx
from naoserver.fake import FakeRobot
from plugins.ros2.tests.integration.test_ros2_gateway import Robot, gateway
from plugins.ros2.tests.support.ros_nodes import Inbox
from tests.support.processes import free_endpoint
from tests.support.robot_server import eventually, wait_for
from tests.support.security import routing
from zenoh_ice import RobotClock, Settings
from zenoh_ros2 import LATCHED, QoS

CLOCK, TRANSFORMS = "rosgraph_msgs/msg/Clock", "tf2_msgs/msg/TFMessage"
FAR_APART = 1000.0
"""Seconds between the times of the two simulations."""


@contextmanager
def simulated(time: float, router: str, **options: Any) -> Iterator[Robot]:
    """Show a robot whose simulation has a time in s, by a router."""
    clock = RobotClock(time, 1.0, simulated=True, silence=math.inf)
    with gateway(FakeRobot(clock), router=router, **options) as robot:
        yield robot


@pytest.fixture(scope="module")
def robots() -> Iterator[tuple[Robot, Robot]]:
    """A robot, and one in the namespace bob, which is simulated for longer."""
    endpoint = free_endpoint()
    with ExitStack() as opened:
        opened.enter_context(routing(Settings(mode="router", listen=(endpoint,))))
        yield (
            opened.enter_context(simulated(0.0, endpoint)),
            opened.enter_context(simulated(FAR_APART, endpoint, namespace="/bob")),
        )


Robots = tuple[Robot, Robot]


def test_no_clock_jumps_back(robots: Robots) -> None:
    for topic, begin in (("/clock", 0.0), ("/bob/clock", FAR_APART)):
        inbox = Inbox()
        subscription = robots[0].ros.create_subscription(CLOCK, topic, inbox, QoS(depth=1000))
        times = [each.clock.sec + each.clock.nanosec / 1e9 for each in inbox.wait(count=20)]
        assert times == sorted(times)
        assert begin <= times[0] < begin + FAR_APART
        subscription.close()


def test_each_frame_of_both_has_one_parent_and_one_time(robots: Robots) -> None:
    ros, inbox = robots[0].ros, Inbox()
    subscriptions = [
        ros.create_subscription(TRANSFORMS, "/tf", inbox, QoS(depth=100)),
        ros.create_subscription(
            TRANSFORMS, "/tf_static", inbox, QoS(durability="transient_local", depth=100)
        ),
    ]

    def placed() -> list[Any]:
        return [each for message in inbox.messages.copy() for each in message.transforms]

    def places(frame: str) -> list[Any]:
        return [each for each in placed() if each.child_frame_id == frame]

    wanted = [prefix + name for prefix in ("", "bob/") for name in ("base_link", "CameraTop_frame")]
    eventually(lambda: all(map(places, wanted)) and all(len(places(each)) > 10 for each in wanted[::2]))
    parents = {(each.child_frame_id, each.header.frame_id) for each in placed()}
    assert len(parents) == len({child for child, _ in parents})
    assert {child.startswith("bob/") for child, parent in parents if parent.startswith("bob/")} == {True}
    assert {child.startswith("bob/") for child, parent in parents if not parent.startswith("bob/")} == {False}
    for frame in ("base_link", "bob/base_link"):
        stamps = [each.header.stamp.sec + each.header.stamp.nanosec / 1e9 for each in places(frame)]
        assert stamps == sorted(stamps)
        assert (stamps[0] >= FAR_APART) is frame.startswith("bob/")
    for each in subscriptions:
        each.close()


def test_the_description_and_headers_have_the_same_frames(robots: Robots) -> None:
    bob = robots[1]
    description = ET.fromstring(bob.topic("/bob/robot_description", LATCHED).data)
    links = {each.attrib["name"] for each in description.iter("link")}
    assert {each[:4] for each in links} == {"bob/"}
    assert {each.attrib["link"] for kind in ("parent", "child") for each in description.iter(kind)} <= links
    odometry = bob.topic("/bob/odom")
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("bob/odom", "bob/base_link")
    assert bob.topic("/bob/sonar/left").header.frame_id in links
    assert bob.topic("/bob/camera/front/camera_info").header.frame_id in links
    assert bob.topic("/bob/battery_state").header.frame_id == ""


def test_commands_have_the_frames_of_their_robot(robots: Robots) -> None:
    bob = robots[1]
    velocity = bob.publisher("geometry_msgs/msg/TwistStamped", "/bob/cmd_vel")
    motors, other = (each.nao.proxy(MotorsPrx, "Motors") for each in (bob, robots[0]))
    velocity.publish(header={"frame_id": "base_link"}, twist={"linear": {"x": 0.1}})
    eventually(lambda: bob.logs("the frame is 'base_link': it must be bob/base_link or bob/base_footprint"))
    velocity.publish(header={"frame_id": "bob/base_link"}, twist={"linear": {"x": 0.1}})
    eventually(lambda: motors.getV() == pytest.approx(0.1))
    assert other.getV() == 0.0
    goal = bob.publisher("geometry_msgs/msg/PoseStamped", "/bob/move_base_simple/goal")
    goal.publish(header={"frame_id": "odom"}, pose={"position": {"x": 0.1}})
    eventually(lambda: bob.logs("the frame is 'odom': it must be bob/odom or bob/base_footprint"))
    count = bob.nao.proxy(WalkPrx, "Walk").getWalkState().count
    goal.publish(header={"frame_id": "bob/odom"}, pose={"position": {"x": 0.1}})
    wait_for(bob.nao.proxy(WalkPrx, "Walk").getWalkState, lambda state: state.count > count)


def test_a_clock_of_several_is_warned_of(robots: Robots) -> None:
    other = robots[1].ros.create_publisher(CLOCK, "/clock")
    eventually(lambda: robots[0].logs("/clock has several publishers: /nao, /tester. It jumps"))
    other.close()
