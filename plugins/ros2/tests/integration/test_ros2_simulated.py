"""The gateway beside the simulated robot: simulated time, a walk that goes somewhere, joints with weight."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

from plugins.ros2.tests.integration.test_ros2_gateway import gateway
from tests.support.limits import CALL_LIMIT, MOVE_LIMIT
from tests.support.robot_server import eventually
from visualhfsm_ros2.gateway._trajectory import SUCCESSFUL, TYPE
from zenoh_ros2 import LATCHED, ActionClient, Node, Status

pytest.importorskip("mujoco", reason="the simulated robot needs MuJoCo: pip install 'visualhfsm[sim]'")

from naoserver_sim._surroundings import SPECTATOR, SPECTATOR_YAW
from naoserver_sim.robot import SimulatedRobot

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def ros() -> Iterator[Node]:
    with gateway(SimulatedRobot(skin=False)) as robot:
        yield robot.ros


def following(ros: Node, type_name: str, name: str) -> Any:
    """Return a subscription that has a message."""
    subscription = ros.create_subscription(type_name, name)
    eventually(lambda: subscription.latest() is not None)
    return subscription


def seconds(stamp: Any) -> float:
    return float(stamp.sec + stamp.nanosec / 1e9)


def test_messages_have_the_time_of_the_clock(ros: Node) -> None:
    clock = following(ros, "rosgraph_msgs/msg/Clock", "/clock")
    states = following(ros, "sensor_msgs/msg/JointState", "/joint_states")
    first = seconds(clock.latest().value.clock)
    eventually(lambda: seconds(clock.latest().value.clock) > first + 0.2)
    now = seconds(clock.latest().value.clock)
    assert seconds(states.latest().value.header.stamp) == pytest.approx(now, abs=MOVE_LIMIT)
    assert now < 3600.0  # since the start, no date


def test_a_velocity_takes_it_forwards_and_silence_leaves_it_standing(ros: Node) -> None:
    odometry = following(ros, "nav_msgs/msg/Odometry", "/odom")
    velocity = ros.create_publisher("geometry_msgs/msg/Twist", "/cmd_vel")
    start = odometry.latest().value.pose.pose.position

    def walked() -> bool:
        velocity.publish(linear={"x": 0.15})
        return bool(odometry.latest().value.pose.pose.position.x > start.x + 0.1)

    eventually(walked)
    eventually(lambda: abs(odometry.latest().value.twist.twist.linear.x) < 0.01)
    place = odometry.latest().value.pose.pose
    assert place.position.z == pytest.approx(0.3, abs=0.06)  # the torso of a robot that stands
    pose, twist = (getattr(odometry.latest().value, part).covariance for part in ("pose", "twist"))
    assert all(pose[7 * axis] > 0.0 and twist[7 * axis] > 0.0 for axis in range(6))


def test_a_trajectory_ends_within_its_tolerance(ros: Node) -> None:
    client = ActionClient(ros, TYPE, "/joint_trajectory_controller/follow_joint_trajectory")
    client.wait(CALL_LIMIT)
    points = [
        {"positions": [0.6, 0.8], "velocities": [0.0, 0.0], "time_from_start": {"sec": 1}},
        {"positions": [-0.4, 1.2], "velocities": [0.0, 0.0], "time_from_start": {"sec": 2}},
    ]
    names = ["HeadYaw", "LShoulderPitch"]
    goal = client.send(
        trajectory={"joint_names": names, "points": points},
        goal_tolerance=[{"name": name, "position": 0.05} for name in names],
        path_tolerance=[{"name": name, "position": 0.5} for name in names],
        timeout=CALL_LIMIT,
    )
    result = goal.result(MOVE_LIMIT)
    assert (goal.status, result.error_code, result.error_string) == (Status.SUCCEEDED, SUCCESSFUL, "")


def test_the_camera_beside_the_robot_stands_where_the_simulation_put_it(ros: Node) -> None:
    fixed = ros.create_subscription("tf2_msgs/msg/TFMessage", "/tf_static", qos=LATCHED)
    eventually(lambda: fixed.latest() is not None)
    sample = fixed.latest()
    assert sample is not None
    frames = {each.child_frame_id: each for each in sample.value.transforms}
    camera, optical = (frames[f"CameraOutside_{name}frame"] for name in ("", "optical_"))
    assert (camera.header.frame_id, optical.header.frame_id) == ("odom", "CameraOutside_frame")
    place = camera.transform.translation
    assert (place.x, place.y, place.z) == pytest.approx(SPECTATOR.position)
    turn = camera.transform.rotation
    ahead = 1 - 2 * (turn.y**2 + turn.z**2), 2 * (turn.x * turn.y + turn.w * turn.z)
    assert math.atan2(ahead[1], ahead[0]) == pytest.approx(SPECTATOR_YAW)
    assert math.asin(2 * (turn.x * turn.z - turn.w * turn.y)) == pytest.approx(-SPECTATOR.tilt)
