"""What components have of ROS: their types, their connections, and what old documents use."""

from __future__ import annotations

import math
from functools import partial

import pytest

from hfsm_runtime import Component, Ros, ros_message, ros_tf
from hfsm_runtime.errors import ComponentError, NotConnectedError
from plugins.ros2.tests.support.ros_nodes import two_nodes
from tests.support.limits import EVENT_LIMIT
from visualhfsm_ros2._ends import Endpoints, stop
from visualhfsm_ros2._node import make_end
from visualhfsm_ros2._virtual import FakeRos
from zenoh_ros2 import ActionServer, CallError, MessageError, Status

# As codegen writes them: each after those that it needs.
TYPES = {"my_msgs/msg/Color": "string name\n", "my_msgs/msg/Ball": "Color color\nfloat64 x\n"}


class Player(Component, document="player.xml", ros_types=TYPES):
    ball = Ros("publish", "/ball", "my_msgs/msg/Ball", stop=True)
    count = Ros("action", "/count", "example_interfaces/action/Fibonacci")


def fake() -> FakeRos:
    return FakeRos(lambda: 0.0, lambda holds, _limit: holds())


def connected(ros: FakeRos) -> Player:
    player = Player()
    ros.connect(player)
    return player


def test_types_of_the_project_are_there_with_those_that_they_need() -> None:
    assert ros_message("my_msgs/msg/Ball", TYPES)(x=2.0).x == 2.0
    ros = fake()
    connected(ros).ball.publish(color={"name": "blue"})
    assert ros.topic("/ball").messages[0].color.name == "blue"


def test_fields_that_are_none_are_named() -> None:
    with pytest.raises(MessageError, match=r"color\.name"):
        connected(fake()).ball.publish(color={"name": 3})


@pytest.mark.slow
def test_goals_need_no_limit_of_their_own() -> None:
    with two_nodes() as (robot, tool):
        ActionServer(
            robot, "example_interfaces/action/Fibonacci", "/count", lambda _goal: {"sequence": [1, 2]}
        )
        player = Player()
        Endpoints(partial(make_end, tool), tool.types).connect(player)
        goal = player.count.send(order=2, timeout=EVENT_LIMIT)
        assert goal.result().sequence.tolist() == [1, 2]
        assert (goal.done, goal.status) == (True, Status.SUCCEEDED)


def test_without_a_connection_the_error_names_the_interface() -> None:
    with pytest.raises(NotConnectedError, match=r"self\.ball \(/ball of ROS\) is not connected"):
        _ = Player().ball


def test_a_type_that_nobody_knows_keeps_a_component_from_starting() -> None:
    class Lost(Component, document="lost.xml", ros_types={"my_msgs/msg/A": "Missing field\n"}):
        a = Ros("publish", "/a", "my_msgs/msg/A")

    with pytest.raises(ComponentError, match="the component cannot start: my_msgs/msg/A"):
        fake().connect(Lost())


def test_stopping_again_publishes_nothing_more_and_one_failure_leaves_the_rest() -> None:
    ros = fake()
    player, action = connected(ros), ros.action("/count")
    player.ball.publish(x=1.0)
    goals = [player.count.send(order=number) for number in (1, 2)]

    def fail(timeout: float = 2.0) -> bool:
        raise CallError("gone")

    action.goals[1].cancel = fail  # type: ignore[method-assign]
    stop(player)
    stop(player)
    assert [each.x for each in ros.topic("/ball").messages] == [1.0, 0.0]
    assert [goal.done for goal in goals] == [True, False]


def test_a_quaternion_becomes_roll_pitch_and_yaw() -> None:
    turn = ros_tf().transformations.euler_from_quaternion
    for axis in range(3):
        for angle in (-3.0, -1.0, 0.0, 0.5, 1.5):
            quaternion = [0.0, 0.0, 0.0, math.cos(angle / 2)]
            quaternion[axis] = math.sin(angle / 2)
            if axis != 1 or abs(angle) < math.pi / 2:
                assert turn(quaternion)[axis] == pytest.approx(angle)
