"""The gateway to ROS: a robot server on one side, a node of ours on the other, over Zenoh on loopback."""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from io import BytesIO
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from interfaces.jderobot import CameraPrx, EncodersPrx, MotorsPrx
from interfaces.nao import ActionStatus, JointsPrx, MotionsPrx, SafetyPrx, SpeechPrx, WalkPrx
from naoserver.bodies import find_body
from naoserver.bodies.kinematics import kinematics_of, turned
from naoserver.bodies.nao import H21, H25
from naoserver.body import Body
from naoserver.fake import FakeRobot
from naoserver.fake.robot import Ball
from naoserver.moves.motion_file import load_motions
from naoserver.moves.routes import MotionRoute
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.robot import Robot as NaoRobot
from tests.support.bodies import CART
from tests.support.commands import run_here
from tests.support.limits import CALL_LIMIT, END_LIMIT, EVENT_LIMIT, FOREVER, MOVE_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.resets import check_that_a_reset_starts_nothing
from tests.support.robot_server import (
    HASTE,
    RobotClient,
    clock_at,
    eventually,
    served,
    served_to_client,
    wait_for,
)
from tests.support.security import routing
from tests.support.soak import cases
from visualhfsm_ros2.gateway._command import EXPECTED, app, serve
from visualhfsm_ros2.gateway._telemetry import Telemetry
from visualhfsm_ros2.gateway._trajectory import (
    GOAL_TOLERANCE_VIOLATED,
    INVALID_GOAL,
    OLD_HEADER_TIMESTAMP,
    PATH_TOLERANCE_VIOLATED,
    SUCCESSFUL,
    TYPE,
)
from zenoh_ice import RobotClock, Settings
from zenoh_ice.threads.limits import Limits
from zenoh_ros2 import LATCHED, ActionClient, Node, QoS, Status, Subscription
from zenoh_ros2._wire import Attachment, key

T1, G1 = find_body("T1"), find_body("G1")
PATIENT = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
"""For tests in which a velocity is to last."""
AT_ONCE = Limits(token_delay=0.05, longest_grace=0.05)
"""For clients that know all servants: one that the robot does not have is missing at once."""
UNHURRIED = ServerOptions(safety=SafetyOptions(velocity_timeout=2.0))
"""A busy machine may renew the velocity of a walk to a place less often than every half second."""
RELIABLE = QoS()
HISTORY = QoS(durability="transient_local", depth=10)
ANGLES = ("naoqi_bridge_msgs/msg/JointAnglesWithSpeed", "/joint_angles")
PATHS = ("trajectory_msgs/msg/JointTrajectory", "/joint_trajectory_controller/joint_trajectory")
TRAJECTORY = "/joint_trajectory_controller/follow_joint_trajectory"


def newest(subscription: Subscription) -> Any:
    """Return the newest message of a subscription; wait for the first."""
    eventually(lambda: subscription.latest() is not None)
    sample = subscription.latest()
    assert sample is not None
    return sample.value


@dataclass
class Robot:
    """A robot behind the gateway: as a client of ours sees it, and as a node of ROS."""

    nao: RobotClient
    ros: Node
    telemetry: Telemetry
    _logs: Subscription | None = None

    def topic(self, name: str, qos: QoS = RELIABLE) -> Any:
        """Return a message of a topic."""
        graph = self.ros.graph
        assert graph.wait(lambda: name in graph.topics(), EVENT_LIMIT)
        subscription = self.ros.create_subscription(graph.topics()[name][0], name, qos=qos)
        value = newest(subscription)
        subscription.close()
        return value

    def servant(self, identity: str) -> Any:
        """Return a servant of the robot server."""
        return self.nao.assembly.servants[identity]

    def logs(self, words: str) -> bool:
        """Return whether the newest log on /rosout has some words."""
        self._logs = self._logs or self.ros.create_subscription(
            "rcl_interfaces/msg/Log", "/rosout", qos=HISTORY
        )
        sample = self._logs.latest()
        return sample is not None and words in sample.value.msg

    def publisher(self, type_name: str, name: str) -> Any:
        """Return a publisher whose subscription is there."""
        publisher = self.ros.create_publisher(type_name, name)
        eventually(lambda: publisher.subscribers > 0)
        return publisher

    def action(self, type_name: str, name: str) -> ActionClient:
        """Return a client of an action that is served."""
        client = ActionClient(self.ros, type_name, name)
        client.wait(EVENT_LIMIT)
        return client


def settings(endpoint: str) -> Settings:
    """Return the settings of a session of this process.

    A busy machine must not cost it its links: one that is made again while a server in the same process closes its
    session is kept alive by what is left of that session, and then nobody looks for the next server.
    """
    return Settings(connect=(endpoint,), listen=("tcp/127.0.0.1:0",), lease=CALL_LIMIT)


@contextmanager
def gateway(
    robot: NaoRobot | None = None, options: ServerOptions | None = None, *, router: str = "", **node: Any
) -> Iterator[Robot]:
    """Serve a robot, and show it to ROS from this process, by a router or by its own server."""
    with (
        served_to_client(robot or FakeRobot(), options) as nao,
        nao.client(timeout=HASTE, limits=AT_ONCE) as other,
        serve(other.communicator, "nao", settings=settings(router or nao.endpoint), **node) as telemetry,
        Node("tester", settings=settings(router or nao.endpoint)) as ros,
    ):
        end = threading.Event()

        def look() -> None:
            while not end.wait(0.02):
                telemetry.poll()

        thread = threading.Thread(target=look)
        thread.start()
        try:
            shown = f"{node.get('namespace', '')}/nao"
            assert ros.graph.wait(lambda: shown in ros.graph.nodes(), EVENT_LIMIT)
            yield Robot(nao, ros, telemetry)
        finally:
            end.set()
            thread.join(END_LIMIT)


@pytest.fixture(scope="module")
def clock() -> RobotClock:
    """The clock of the robot that most tests share, at the pace of the wall's."""
    return clock_at(1.0)


@pytest.fixture
def hurried(clock: RobotClock) -> Iterator[None]:
    """The same clock at a higher pace, for what lasts in robot time only."""
    clock.update(clock.now(), 4.0, clock.simulated)
    yield
    clock.update(clock.now(), 1.0, clock.simulated)


hurriedly = pytest.mark.usefixtures("hurried")


@pytest.fixture(scope="module")
def robot(clock: RobotClock) -> FakeRobot:
    """The robot that most tests share."""
    return FakeRobot(clock)


@pytest.fixture(scope="module")
def shared(robot: FakeRobot) -> Iterator[Robot]:
    with gateway(robot, UNHURRIED) as shown:
        yield shown


@pytest.fixture(scope="module")
def humanoid() -> Iterator[Robot]:
    """Another robot, whose velocities end after the usual silence."""
    with gateway(FakeRobot(body=T1)) as shown:
        yield shown


# What the robot reports


def test_joint_states_are_those_of_the_robot(shared: Robot) -> None:
    message = shared.topic("/joint_states")
    assert tuple(message.name) == H25.joint_names
    expected = [H25.postures["StandInit"].angles[name] for name in message.name]
    assert [*message.position] == pytest.approx(expected, abs=0.01)
    assert abs(message.header.stamp.sec - shared.ros.now().sec) < 60


def test_the_tree_of_frames_reaches_from_odom_to_the_cameras(shared: Robot) -> None:
    moving, fixed = shared.topic("/tf"), shared.topic("/tf_static", LATCHED)
    parents = {each.child_frame_id: each.header.frame_id for each in [*moving.transforms, *fixed.transforms]}
    way = ["CameraTop_optical_frame"]
    while way[-1] in parents:
        way.append(parents[way[-1]])
    assert way[-1] == "odom"
    assert {"torso", "base_link"} <= {*way}
    assert parents["base_footprint"] == "base_link"


def test_who_joins_late_gets_the_description(shared: Robot) -> None:
    assert '<robot name="nao_h25">' in shared.topic("/robot_description", LATCHED).data


@pytest.mark.parametrize(
    ("name", "frame"),
    [
        ("/imu/torso", "base_link"),
        ("/odom", "odom"),
        ("/sonar/left", "LSonar_frame"),
        ("/fsr/right", "r_sole"),
        ("/battery_state", ""),
        ("/diagnostics", ""),
        ("/camera/bottom/camera_info", "CameraBottom_optical_frame"),
    ],
)
def test_each_sense_is_a_topic(shared: Robot, name: str, frame: str) -> None:
    assert shared.topic(name).header.frame_id == frame


def test_a_camera_gives_pixels_and_jpeg(shared: Robot) -> None:
    raw, jpeg = shared.topic("/camera/front/image_raw"), shared.topic("/camera/front/image_raw/compressed")
    assert (raw.width, raw.height, len(raw.data)) == (320, 240, 320 * 240 * 3)
    assert Image.open(BytesIO(bytes(jpeg.data))).size == (320, 240)


def test_a_camera_takes_images_only_while_somebody_listens(shared: Robot) -> None:
    camera = shared.servant("CameraBottom")
    subscription = shared.ros.create_subscription("sensor_msgs/msg/Image", "/camera/bottom/image_raw")
    eventually(lambda: subscription.latest() is not None)
    assert camera.wanted
    subscription.close()
    eventually(lambda: not camera.wanted)


def place_in(transforms: list[Any], frame: str, root: str) -> np.ndarray[Any, Any]:
    """Return the place of a frame in another one, above it in the tree, as a matrix."""
    above = {each.child_frame_id: each for each in transforms}
    place = np.eye(4)
    while frame != root:
        way, turn = above[frame].transform.translation, above[frame].transform.rotation
        link = turned((turn.w, turn.x, turn.y, turn.z))
        link[:3, 3] = way.x, way.y, way.z
        place, frame = link @ place, above[frame].header.frame_id
    return place


def test_what_a_camera_shows_is_where_it_is_by_the_tree_of_frames(shared: Robot, robot: FakeRobot) -> None:
    message = shared.topic("/camera/front/detections")
    transforms = [*shared.topic("/tf").transforms, *shared.topic("/tf_static", LATCHED).transforms]
    camera = place_in(transforms, message.header.frame_id, "base_link")
    angles = dict(zip(H25.joint_names, robot.read().positions, strict=True))
    torso = kinematics_of(H25).torso_place(angles)
    balls = {f"ball:{color}": robot.mechanisms[at] for at, color in enumerate(("red", "green"))}
    for each in message.detections:
        (result,) = each.results
        at = result.pose.pose.position
        ball = Ball(*balls.pop(result.hypothesis.class_id).read().positions)
        assert torso @ camera @ (at.x, at.y, at.z, 1.0) == pytest.approx((*ball.place, 1.0), abs=0.01)
    assert not balls
    assert "/camera/bottom/detections" in shared.ros.graph.topics()
    assert "/camera/outside/detections" not in shared.ros.graph.topics()


def test_a_robot_that_serves_no_sight_announces_no_detections() -> None:
    with gateway(options=ServerOptions(sight=False)) as robot:
        assert robot.ros.graph.wait(lambda: "/cmd_vel" in robot.ros.graph.topics(), EVENT_LIMIT)
        assert "/camera/front/detections" not in robot.ros.graph.topics()


def test_a_touch_is_an_event(shared: Robot, robot: FakeRobot) -> None:
    head = shared.ros.create_subscription("naoqi_bridge_msgs/msg/HeadTouch", "/head_touch")
    eventually(lambda: shared.servant("Touch").getTouchReadingPublisher.listening)
    robot.senses.feel(touched=frozenset({"HeadMiddle"}))
    event = newest(head)
    assert (event.button, event.state) == (2, 1)


def test_a_robot_without_simulation_has_no_clock(shared: Robot) -> None:
    assert "/clock" not in shared.ros.graph.topics()


def test_an_h21_has_no_hands_that_feel_and_names_are_remapped_and_in_the_namespace() -> None:
    options: dict[str, Any] = {"remap": {"cmd_vel": "cmd_vel_safe"}, "frame_prefix": ""}
    with gateway(FakeRobot(body=H21), namespace="/red", **options) as robot:
        graph, names = robot.ros.graph, {"/red/joint_states", "/red/cmd_vel_safe", "/tf"}
        assert graph.wait(lambda: names <= graph.topics().keys(), EVENT_LIMIT), graph.topics().keys()
        assert len(robot.topic("/red/joint_states").name) == 22
        assert '<robot name="nao_h21">' in robot.topic("/red/robot_description", LATCHED).data
        assert "base_footprint" in {each.child_frame_id for each in robot.topic("/tf").transforms}
        assert "/red/head_touch" in graph.topics()
        assert "/red/hand_touch" not in graph.topics()


def check_it_is_shown_as_its_server_describes_it(robot: Robot, body: Body) -> None:
    description = ET.fromstring(robot.topic("/robot_description", LATCHED).data)
    assert {link.name for link in body.links} <= {link.get("name") for link in description.iter("link")}
    assert tuple(robot.topic("/joint_states").name) == body.joint_names
    moving, fixed = robot.topic("/tf"), robot.topic("/tf_static", LATCHED)
    shown = {each.child_frame_id for each in [*moving.transforms, *fixed.transforms]}
    assert {link.name for link in body.links} <= shown
    assert {"base_footprint", "Camera_optical_frame"} <= shown
    topics = robot.ros.graph.topics().keys()
    assert "/camera/front/image_raw" in topics
    assert ("/cmd_vel" in topics) is (body.walk is not None)
    assert ("/imu/torso" in topics) is (body.inertial_unit is not None)
    assert ("/sonar/left" in topics) is (body.sonar is not None)
    assert "/bumper" not in topics
    assert "/camera/bottom/image_raw" not in topics


@pytest.mark.parametrize("body", cases([CART], [G1]), ids=lambda body: str(body.name))
def test_any_robot_is_shown_as_its_server_describes_it(body: Body) -> None:
    with gateway(FakeRobot(body=body)) as robot:
        check_it_is_shown_as_its_server_describes_it(robot, body)


def test_any_robot_is_shown_and_moves_by_the_names_of_its_joints_and_limbs(humanoid: Robot) -> None:
    check_it_is_shown_as_its_server_describes_it(humanoid, T1)
    body, angles = humanoid.nao.proxy(JointsPrx, "Body"), humanoid.publisher(*ANGLES)
    angles.publish(joint_names=["Head"], joint_angles=[0.3, 0.2], speed=1.0)
    head = [T1.joint_names.index(joint) for joint in T1.groups.head]
    wait_for(
        body.getJointState,
        lambda state: [state.positions[joint] for joint in head] == pytest.approx([0.3, 0.2], abs=0.01),
    )
    angles.publish(joint_names=["LShoulderPitch"], joint_angles=[0.3], speed=1.0)
    eventually(lambda: humanoid.logs("there is no joint 'LShoulderPitch'; there are "))


# What ROS asks of it


def test_a_stamped_velocity_drives_the_walk_in_the_robots_frame_only(shared: Robot) -> None:
    motors = shared.nao.proxy(MotorsPrx, "Motors")
    velocity = shared.publisher("geometry_msgs/msg/TwistStamped", "/cmd_vel")
    velocity.publish(header={"frame_id": "odom"}, twist={"linear": {"x": 0.1}})
    eventually(lambda: shared.logs("/cmd_vel: refused: the frame is 'odom'"))
    assert motors.getV() == 0.0
    velocity.publish(header={"frame_id": "base_link"}, twist={"linear": {"x": 0.1}, "angular": {"z": 0.2}})
    eventually(lambda: (motors.getV(), motors.getW()) == pytest.approx((0.1, 0.2)))
    velocity.publish(header={"frame_id": "base_link"})
    eventually(lambda: (motors.getV(), motors.getW()) == (0.0, 0.0))


def test_a_publisher_of_another_type_is_warned_of(shared: Robot) -> None:
    logged: list[str] = []  # each, for several may come at once
    logs = shared.ros.create_subscription(
        "rcl_interfaces/msg/Log", "/rosout", lambda log: logged.append(log.msg), qos=HISTORY
    )
    shared.publisher("geometry_msgs/msg/Twist", "/cmd_vel")
    shared.publisher("geometry_msgs/msg/TwistStamped", "/cmd_vel")
    shared.ros.create_publisher("geometry_msgs/msg/Vector3", "/cmd_vel")
    words = "/cmd_vel: a publisher is not heard: /tester publishes geometry_msgs/msg/Vector3"
    eventually(lambda: any(words in each for each in logged))
    logs.close()


def test_a_velocity_that_is_no_number_moves_nothing(shared: Robot) -> None:
    motors = shared.nao.proxy(MotorsPrx, "Motors")
    velocity = shared.publisher("geometry_msgs/msg/Twist", "/cmd_vel")
    velocity.publish(linear={"x": 0.1}, angular={"z": math.nan})
    eventually(lambda: shared.logs("angular.z is nan"))
    assert motors.getV() == 0.0


@hurriedly
def test_it_walks_to_a_place_in_either_frame(shared: Robot) -> None:
    walk, encoders = shared.nao.proxy(WalkPrx, "Walk"), shared.nao.proxy(EncodersPrx, "Encoders")
    goal = shared.publisher("geometry_msgs/msg/PoseStamped", "/move_base_simple/goal")
    ahead = {"x": 0.2, "y": 0.05}
    turn = {"w": math.cos(0.25), "z": math.sin(0.25)}

    def walks(frame: str) -> tuple[float, float, float]:
        count = walk.getWalkState().count
        goal.publish(header={"frame_id": frame}, pose={"position": ahead, "orientation": turn})
        state = wait_for(
            walk.getWalkState, lambda state: state.count == count + 1 and state.status is ActionStatus.Done
        )
        assert state.message == ""
        there = encoders.getEncodersData()
        return there.robotx, there.roboty, there.robottheta

    assert walks("odom") == pytest.approx((0.2, 0.05, 0.5), abs=0.05)
    before = encoders.getEncodersData()
    cosine, sine = before.robotcos, before.robotsin
    x, y = before.robotx + cosine * 0.2 - sine * 0.05, before.roboty + sine * 0.2 + cosine * 0.05
    assert walks("base_footprint") == pytest.approx((x, y, before.robottheta + 0.5), abs=0.05)


@pytest.mark.parametrize(
    ("frame", "pose", "words"),
    [
        ("map", {}, "'map'"),
        ("odom", {"position": {"x": math.nan}}, "the place is not a finite number"),
        (
            "odom",
            {"orientation": {"w": 1e200, "y": 1e200, "z": 1e200}},
            "the orientation is not a finite number",
        ),
        ("odom", {"position": {"x": 1e300}}, "it must be from -100 to 100"),
    ],
)
def test_a_place_that_makes_no_sense_is_refused(
    shared: Robot, frame: str, pose: dict[str, object], words: str
) -> None:
    walk = shared.nao.proxy(WalkPrx, "Walk")
    count = walk.getWalkState().count
    goal = shared.publisher("geometry_msgs/msg/PoseStamped", "/move_base_simple/goal")
    goal.publish(header={"frame_id": frame}, pose=pose)
    eventually(lambda: shared.logs(words))
    assert walk.getWalkState().count == count


def test_who_holds_the_lease_is_not_disturbed(shared: Robot) -> None:
    safety = shared.nao.proxy(SafetyPrx, "Safety")
    safety.acquireLease("somebody", 60.0)
    shared.publisher("geometry_msgs/msg/Twist", "/cmd_vel").publish(linear={"x": 0.1})
    eventually(lambda: shared.logs("somebody"))
    assert shared.nao.proxy(MotorsPrx, "Motors").getV() == 0.0
    safety.releaseLease()


def test_the_emergency_stop_latches_until_its_reset(shared: Robot) -> None:
    safety = shared.nao.proxy(SafetyPrx, "Safety")
    stop, reset = (
        shared.ros.create_client("std_srvs/srv/Trigger", f"/nao/{name}")
        for name in ("emergency_stop", "reset")
    )
    stop.wait(EVENT_LIMIT)
    assert stop.call(timeout=CALL_LIMIT).success
    assert safety.getSafetyState().stopped
    result = follow(shared, {"HeadYaw": 0.3}).result(MOVE_LIMIT)
    assert (result.error_code, "emergency stop from ROS" in result.error_string) == (INVALID_GOAL, True)
    assert reset.call(timeout=CALL_LIMIT).success
    assert not safety.getSafetyState().stopped
    resume = shared.ros.create_client("std_srvs/srv/Trigger", "/nao/resume")
    resume.wait(EVENT_LIMIT)
    assert resume.call(timeout=CALL_LIMIT).success
    follow(shared, {"HeadYaw": 0.3}).result(MOVE_LIMIT)
    assert position(shared, "HeadYaw") == pytest.approx(0.3, abs=0.01)


def test_a_reset_starts_no_walk_of_a_node_that_publishes_on(
    shared: Robot, robot: FakeRobot, caplog: pytest.LogCaptureFixture
) -> None:
    velocity, walker = shared.publisher("geometry_msgs/msg/Twist", "/cmd_vel"), robot.walker
    assert walker is not None
    check_that_a_reset_starts_nothing(
        shared.nao.assembly,
        lambda: velocity.publish(linear={"x": 0.1}),
        lambda: walker.commanded().forward > 0.0,
    )
    assert "/cmd_vel: refused: the emergency stop ended the commands of " in caplog.text


def test_a_reset_starts_no_trajectory_that_waits(
    shared: Robot, robot: FakeRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    walker = robot.walker
    assert walker is not None
    eventually(lambda: not walker.commanded().forward)  # no walk of another test asks the gate, too
    gate, begin, waits = shared.nao.assembly.gate, position(shared, "HeadYaw"), threading.Event()
    require = gate.require

    def asked(client: str, *, begun: bool = False) -> None:
        require(client, begun=begun)
        waits.set()

    monkeypatch.setattr(gate, "require", asked)
    soon = {"header": {"stamp": {"sec": int(time.time()) + 10}}}
    goal = follow(shared, {"HeadYaw": begin + 0.3}, trajectory=soon)
    assert waits.wait(EVENT_LIMIT)
    gate.stop("a test")
    gate.reset()
    result = goal.result(MOVE_LIMIT)
    assert (result.error_code, result.error_string) == (INVALID_GOAL, "the robot was stopped before it began")
    assert position(shared, "HeadYaw") == pytest.approx(begin)
    gate.reset(resume=True)  # other tests command by the same gateway


@pytest.mark.parametrize(
    ("names", "angles", "relative", "expected"),
    [
        (["HeadYaw", "HeadPitch"], [0.4, 0.2], 0, {"HeadYaw": 0.4, "HeadPitch": 0.2}),
        (["Head"], [-0.3, 0.1], 0, {"HeadYaw": -0.3, "HeadPitch": 0.1}),
        (["LElbowYaw"], [0.2], 1, {"LElbowYaw": H25.postures["StandInit"].angles["LElbowYaw"] + 0.2}),
    ],
)
def test_joints_go_to_angles(
    shared: Robot, names: list[str], angles: list[float], relative: int, expected: dict[str, float]
) -> None:
    body = shared.nao.proxy(JointsPrx, "Body")
    publisher = shared.publisher("naoqi_bridge_msgs/msg/JointAnglesWithSpeed", "/joint_angles")
    publisher.publish(joint_names=names, joint_angles=angles, speed=1.0, relative=relative)

    def there() -> bool:
        positions = dict(zip(H25.joint_names, body.getJointState().positions, strict=True))
        return all(abs(positions[name] - angle) < 0.02 for name, angle in expected.items())

    eventually(there)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"joint_names": ["Nose", "HeadYaw"], "joint_angles": [0.1, 0.1]}, "'Nose'"),
        ({"joint_names": ["HeadYaw"], "joint_angles": [math.inf]}, "HeadYaw is inf"),
        ({"joint_names": ["Body"], "joint_angles": [0.1]}, "1 angles for 26 joints"),
        ({"joint_names": ["HeadYaw"] * 2000, "joint_angles": [0.1] * 2000}, "2000 joints"),
        (
            {"joint_names": ["HeadYaw"] * 5000, "joint_angles": [0.1] * 5000},
            "80033 bytes; at most 65536 are decoded",
        ),
    ],
)
def test_angles_that_make_no_sense_are_refused_by_name(
    shared: Robot, fields: dict[str, object], words: str
) -> None:
    publisher = shared.publisher("naoqi_bridge_msgs/msg/JointAnglesWithSpeed", "/joint_angles")
    publisher.publish(**fields, speed=1.0)
    eventually(lambda: shared.logs(words))


@hurriedly
def test_it_says_what_it_is_asked_to(shared: Robot) -> None:
    shared.publisher("std_msgs/msg/String", "/speech").publish(data="hello")
    speech = shared.nao.proxy(SpeechPrx, "Speech")
    eventually(lambda: speech.getSpeech().text == "hello")
    spoken = shared.action("naoqi_bridge_msgs/action/SpeechWithFeedback", "/speech_action").send(say="a word")
    spoken.result(MOVE_LIMIT)
    assert (spoken.status, speech.getSpeech().text) == (Status.SUCCEEDED, "a word")


@hurriedly
def test_a_posture_is_an_action(shared: Robot) -> None:
    goal = shared.action("naoqi_bridge_msgs/action/BodyPoseWithSpeed", "/body_pose_naoqi").send(
        posture_name="Crouch", speed=1.0
    )
    goal.result(MOVE_LIMIT)
    assert goal.status is Status.SUCCEEDED
    unknown = shared.action("naoqi_bridge_msgs/action/BodyPose", "/body_pose").send(pose_name="Fly")
    unknown.result(MOVE_LIMIT)
    assert unknown.status is Status.ABORTED


def test_a_motion_is_an_action_that_can_be_cancelled(shared: Robot) -> None:
    goal = shared.action("naoqi_bridge_msgs/action/RunBehavior", "/run_behavior").send(behavior="dance")
    body = shared.nao.proxy(JointsPrx, "Body")
    start = body.getJointState().positions
    eventually(lambda: body.getJointState().positions != start)
    assert goal.cancel(CALL_LIMIT)
    goal.result(MOVE_LIMIT)
    assert goal.status is Status.CANCELED


# Trajectories


def follow(robot: Robot, *points: dict[str, float], seconds: float = 0.5, **fields: Any) -> Any:
    """Send a trajectory whose points are `seconds` apart."""
    listed = [
        {
            "positions": [*point.values()],
            "time_from_start": {"sec": int(seconds * index), "nanosec": round(seconds * index % 1 * 1e9)},
        }
        for index, point in enumerate(points, 1)
    ]
    trajectory = {"joint_names": [*points[0]], "points": listed, **fields.pop("trajectory", {})}
    return robot.action(TYPE, TRAJECTORY).send(trajectory=trajectory, timeout=CALL_LIMIT, **fields)


def test_a_trajectory_is_followed_with_feedback(shared: Robot) -> None:
    body = shared.nao.proxy(JointsPrx, "Body")
    tolerance = [{"name": name, "position": 0.05} for name in ("HeadYaw", "RElbowRoll")]
    goal = follow(
        shared,
        {"HeadYaw": 0.5, "RElbowRoll": 0.8},
        {"HeadYaw": -0.2, "RElbowRoll": 1.2},
        seconds=0.3,
        goal_tolerance=tolerance,
    )
    result = goal.result(MOVE_LIMIT)
    assert (goal.status, result.error_code) == (Status.SUCCEEDED, SUCCESSFUL)
    reached = dict(zip(H25.joint_names, body.getJointState().positions, strict=True))
    assert (reached["HeadYaw"], reached["RElbowRoll"]) == pytest.approx((-0.2, 1.2), abs=0.05)
    feedback = goal.feedback
    assert feedback.joint_names == ["HeadYaw", "RElbowRoll"]
    assert feedback.error.positions == pytest.approx(feedback.desired.positions - feedback.actual.positions)


def test_a_cancelled_trajectory_holds_where_it_is(shared: Robot) -> None:
    body = shared.nao.proxy(JointsPrx, "Body")
    goal = follow(shared, {"LShoulderPitch": 0.0}, seconds=5.0)
    eventually(lambda: goal.feedback is not None)
    assert goal.cancel(CALL_LIMIT)
    goal.result(MOVE_LIMIT)
    assert goal.status is Status.CANCELED
    index = H25.joint_names.index("LShoulderPitch")
    eventually(lambda: abs(body.getJointState().velocities[index]) < 0.01)
    assert body.getJointState().positions[index] > 0.3


@pytest.mark.parametrize(
    ("fields", "code", "words"),
    [
        ({"trajectory": {"header": {"stamp": {"sec": 5}}}}, OLD_HEADER_TIMESTAMP, "s ago"),
        (
            {"path_tolerance": [{"name": "HeadYaw", "position": 1e-9}]},
            PATH_TOLERANCE_VIOLATED,
            "HeadYaw is at",
        ),
        (
            {
                "goal_tolerance": [{"name": "HeadYaw", "position": 1e-12}],
                "goal_time_tolerance": {"nanosec": 100_000_000},
            },
            GOAL_TOLERANCE_VIOLATED,
            "HeadYaw is at",
        ),
    ],
)
def test_a_trajectory_that_fails_says_why_by_its_code(
    shared: Robot, fields: dict[str, Any], code: int, words: str
) -> None:
    goal = follow(shared, {"HeadYaw": 0.6}, seconds=0.2, **fields)
    result = goal.result(MOVE_LIMIT)
    assert (goal.status, result.error_code) == (Status.ABORTED, code)
    assert words in result.error_string


def test_a_newer_trajectory_takes_the_joints_of_an_older_one(shared: Robot) -> None:
    older = follow(shared, {"HeadYaw": 1.0, "HeadPitch": 0.1}, seconds=5.0)
    eventually(lambda: older.feedback is not None)
    newer = follow(shared, {"HeadPitch": 0.0}, seconds=0.2)
    assert "a newer trajectory" in older.result(MOVE_LIMIT).error_string
    assert newer.result(MOVE_LIMIT).error_code == SUCCESSFUL


# Commanders that are gone


@pytest.fixture
def commander(shared: Robot) -> Iterator[Node]:
    """A node that ends during the test."""
    with Node("commander", settings=settings(shared.nao.endpoint)) as node:
        yield node


def position(shared: Robot, joint: str) -> float:
    """Return the setpoint of a joint in rad."""
    return float(shared.nao.proxy(JointsPrx, "Body").getJointState().commands[H25.joint_names.index(joint)])


def rests(shared: Robot, joint: str) -> None:
    """Wait until the setpoint of a joint no longer changes."""
    last = math.inf

    def still() -> bool:
        nonlocal last
        before, last = last, position(shared, joint)
        time.sleep(0.1)
        return before == last

    eventually(still)


def trajectory(*points: tuple[float, float], joint: str = "HeadYaw") -> dict[str, object]:
    """Return the fields of a trajectory of one joint: positions in rad at times in s."""
    listed = [
        {"positions": [angle], "time_from_start": {"sec": int(time), "nanosec": round(time % 1 * 1e9)}}
        for angle, time in points
    ]
    return {"joint_names": [joint], "points": listed}


def send_slowly(commander: Node, joint: str, angle: float) -> None:
    """Send a joint to a far angle."""
    publisher = commander.create_publisher(*ANGLES)
    eventually(lambda: publisher.heard)
    publisher.publish(joint_names=[joint], joint_angles=[angle], speed=0.02)


def plan(commander: Node, joint: str, angle: float) -> None:
    """Publish a trajectory that lasts for a minute."""
    publisher = commander.create_publisher(*PATHS)
    eventually(lambda: publisher.subscribers > 0)
    publisher.publish(**trajectory((angle, 60.0), joint=joint))


def pursue(commander: Node, joint: str, angle: float) -> None:
    """Send such a trajectory as a goal."""
    client = ActionClient(commander, TYPE, TRAJECTORY)
    client.wait(EVENT_LIMIT)
    client.send(trajectory=trajectory((angle, 60.0), joint=joint), timeout=CALL_LIMIT)


@pytest.mark.parametrize(
    ("send", "way", "words"),
    [
        (send_slowly, ("LShoulderPitch", -1.5), "its publisher is gone: LShoulderPitch held"),
        (plan, ("HeadYaw", 1.0), "its publisher is gone: its joints are held"),
        (pursue, ("HeadYaw", -1.0), "a goal is cancelled: its client is gone"),
    ],
    ids=["angles", "trajectory of a topic", "trajectory of an action"],
)
def test_joints_are_held_when_who_moved_them_is_gone(
    shared: Robot,
    commander: Node,
    send: Callable[[Node, str, float], None],
    way: tuple[str, float],
    words: str,
) -> None:
    joint, far = way
    begin = position(shared, joint)
    send(commander, joint, begin + far)
    eventually(lambda: (position(shared, joint) - begin) / far > 0.005)
    commander.close()
    eventually(lambda: shared.logs(words))
    rests(shared, joint)
    assert abs(position(shared, joint) - begin - far) > 0.1


def test_joints_are_held_when_the_router_of_an_earlier_publisher_is_lost() -> None:
    endpoint = free_endpoint()
    with (
        routing(Settings(mode="router", connect=(), listen=(endpoint,))) as router,
        Node("commander", settings=settings(endpoint)) as commander,
    ):
        publisher = commander.create_publisher(*ANGLES)
        with gateway(router=endpoint) as robot:
            eventually(lambda: publisher.heard)
            begin = position(robot, "LShoulderPitch")
            goal = begin - 1.5
            publisher.publish(joint_names=["LShoulderPitch"], joint_angles=[goal], speed=0.02)
            eventually(lambda: position(robot, "LShoulderPitch") < begin - 0.02)
            router.process.kill()
            rests(robot, "LShoulderPitch")
            assert position(robot, "LShoulderPitch") > goal + 0.1


def test_a_joint_that_somebody_else_took_is_not_held(shared: Robot, commander: Node) -> None:
    begin = position(shared, "RShoulderPitch")
    send_slowly(commander, "RShoulderPitch", begin - 1.0)
    eventually(lambda: position(shared, "RShoulderPitch") < begin - 0.02)
    shared.nao.proxy(JointsPrx, "Body").setJointPositions({"RShoulderPitch": begin + 0.3}, 0.05)
    eventually(lambda: position(shared, "RShoulderPitch") > begin)
    commander.close()
    eventually(lambda: position(shared, "RShoulderPitch") == pytest.approx(begin + 0.3, abs=0.001))


def test_joints_of_who_never_announced_itself_are_held(shared: Robot) -> None:
    begin = position(shared, "LElbowYaw")
    kind = "naoqi_bridge_msgs/msg/JointAnglesWithSpeed"
    ros = shared.ros
    data = ros.types.encode(
        ros.types.make(kind, joint_names=["LElbowYaw"], joint_angles=[begin + 1.5], speed=0.02)
    )
    attachment = Attachment(1, 0, b"unannounced here").encode()
    ros.session.put(key(0, "/joint_angles", kind, ros.types.hash(kind)), data, attachment=attachment)
    eventually(lambda: shared.logs("its publisher is gone: LElbowYaw held"))
    rests(shared, "LElbowYaw")
    assert begin < position(shared, "LElbowYaw") < begin + 1.4


@hurriedly
def test_a_walk_to_a_place_ends_when_its_publisher_is_gone(shared: Robot, commander: Node) -> None:
    walk = shared.nao.proxy(WalkPrx, "Walk")
    count = walk.getWalkState().count
    goal = commander.create_publisher("geometry_msgs/msg/PoseStamped", "/move_base_simple/goal")
    eventually(lambda: goal.heard)
    goal.publish(header={"frame_id": "base_footprint"}, pose={"position": {"x": 50.0}})
    wait_for(walk.getWalkState, lambda state: state.count > count and state.status is ActionStatus.Moving)
    commander.close()
    wait_for(walk.getWalkState, lambda state: state.status is ActionStatus.Stopped)


def test_a_motion_stops_when_its_client_is_gone(shared: Robot, commander: Node) -> None:
    motions = shared.nao.proxy(MotionsPrx, "Motions")
    count = motions.getMotionState().count
    client = ActionClient(commander, "naoqi_bridge_msgs/action/RunBehavior", "/run_behavior")
    client.wait(EVENT_LIMIT)
    client.send(behavior="dance", timeout=CALL_LIMIT)
    eventually(lambda: motions.getMotionState().count > count)
    commander.close()
    wait_for(motions.getMotionState, lambda state: state.status is ActionStatus.Stopped)


def test_no_peer_sends_its_tokens_to_the_gateway(shared: Robot) -> None:
    graph, peer = shared.ros.graph, shared.ros.session.info
    assert graph.wait(lambda: "/nao" in graph.nodes(), EVENT_LIMIT)
    gateway = next(each.session for each in graph.entities("NN") if each.node_name == "/nao")
    assert gateway not in {str(zid) for zid in peer.peers_zid()}, (
        "it is a client, which gets what it asks for"
    )


# Parameters


def ask(robot: Robot, service: str, **request: Any) -> Any:
    name = "".join(f"_{each.lower()}" if each.isupper() else each for each in service).lstrip("_")
    client = robot.ros.create_client(f"rcl_interfaces/srv/{service}", f"/nao/{name}")
    client.wait(EVENT_LIMIT)
    return client.call(timeout=CALL_LIMIT, **request)


def set_parameter(robot: Robot, name: str, kind: int, **value: object) -> Any:
    parameter = {"name": name, "value": {"type": kind, **value}}
    return ask(robot, "SetParameters", parameters=[parameter]).results[0]


def test_the_node_has_parameters(shared: Robot) -> None:
    names = ask(shared, "ListParameters").result.names
    assert {"use_sim_time", "camera.front.image_size", "camera.bottom.frame_rate"} <= set(names)
    (simulated,) = ask(shared, "GetParameters", names=["use_sim_time"]).values
    assert (simulated.type, simulated.bool_value) == (1, False)
    assert "read-only" in set_parameter(shared, "use_sim_time", 1, bool_value=True).reason


def test_the_size_of_images_is_a_parameter(shared: Robot) -> None:
    camera = shared.nao.proxy(CameraPrx, "Camera")
    size, rate = "camera.front.image_size", "camera.front.frame_rate"
    try:
        for wrong in ([77, 240], [1 << 40, 1 << 40], [-1, 2], [320]):
            assert not set_parameter(shared, size, 7, integer_array_value=wrong).successful, wrong
        assert not set_parameter(shared, rate, 3, double_value=math.nan).successful
        assert set_parameter(shared, size, 7, integer_array_value=[640, 480]).successful
        assert set_parameter(shared, rate, 3, double_value=5.0).successful
        eventually(lambda: shared.topic("/camera/front/image_raw").width == 640)
        eventually(lambda: shared.topic("/camera/front/camera_info").height == 480)
    finally:
        camera.reset()
    now, pace = ask(shared, "GetParameters", names=[size, rate]).values  # another client changed them
    assert now.integer_array_value.tolist() == [320, 240]
    assert pace.double_value != 5.0


def test_the_speed_of_the_walk_is_a_parameter(shared: Robot) -> None:
    motors = shared.nao.proxy(MotorsPrx, "Motors")
    name = "walk.max_linear_speed"
    assert not set_parameter(shared, name, 3, double_value=-1.0).successful
    assert set_parameter(shared, name, 3, double_value=0.05).successful
    velocity = shared.publisher("geometry_msgs/msg/Twist", "/cmd_vel")
    velocity.publish(linear={"x": 0.1}, angular={"z": 0.4})
    eventually(lambda: (motors.getV(), motors.getW()) == pytest.approx((0.05, 0.2)))
    assert set_parameter(shared, name, 3, double_value=1.0).successful
    velocity.publish()
    eventually(lambda: (motors.getV(), motors.getW()) == (0.0, 0.0))


# Others beside ROS


def test_a_text_that_somebody_drops_ends_its_goal(
    shared: Robot, robot: FakeRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert robot.voice is not None
    said, say = list[str](), robot.voice.say

    def noting(text: str) -> None:
        say(text)
        said.append(text)

    monkeypatch.setattr(robot.voice, "say", noting)
    speech = shared.nao.proxy(SpeechPrx, "Speech")
    speech.stop()
    speech.say("a text that takes long to say " * 20)
    eventually(lambda: speech.getSpeech().speaking)
    count = speech.getSpeech().count
    goal = shared.action("naoqi_bridge_msgs/action/SpeechWithFeedback", "/speech_action").send(say="late")
    eventually(lambda: goal.status is Status.EXECUTING and "late" in said)
    speech.stop()
    goal.result(MOVE_LIMIT)
    assert goal.status is Status.ABORTED
    assert speech.getSpeech().count == count


def test_a_motion_of_somebody_else_is_not_taken_for_the_goals_own(
    shared: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    motions, servant = shared.nao.proxy(MotionsPrx, "Motions"), shared.servant("Motions")
    player, begin = servant._player, servant._player.begin

    def begin_and_lose(kind: str, name: str, route: Any, **options: Any) -> None:
        begin(kind, name, route, **options)
        if name == "dance":
            begin(kind, "wave", MotionRoute(player.body, load_motions(player.body)["wave"]), **options)

    monkeypatch.setattr(player, "begin", begin_and_lose)
    goal = shared.action("naoqi_bridge_msgs/action/RunBehavior", "/run_behavior").send(behavior="dance")
    goal.result(MOVE_LIMIT)
    assert goal.status is Status.ABORTED
    assert motions.getMotionState().name == "wave"
    assert motions.getMotionState().status in (ActionStatus.Moving, ActionStatus.Done)
    motions.stop()


# The command


def command(nao: RobotClient, *options: str, timeout: float = HASTE) -> ComponentProcess:
    return ComponentProcess(
        module(
            "visualhfsm_ros2.gateway",
            *("--connect", nao.endpoint, "--realm", nao.realm, "--timeout", str(timeout)),
            *options,
        )
    )


def test_a_killed_gateway_stops_what_it_drove() -> None:
    with served_to_client(FakeRobot(), PATIENT) as nao, command(nao) as process:
        process.wait_for(r"^ready: /nao, ")
        motors = nao.proxy(MotorsPrx, "Motors")
        with Node("teleop", settings=settings(nao.endpoint)) as ros:
            velocity = ros.create_publisher("geometry_msgs/msg/Twist", "/cmd_vel")
            eventually(lambda: velocity.subscribers > 0)
            velocity.publish(linear={"x": 0.1})
            eventually(lambda: motors.getV() > 0.0)
            process.process.kill()
            eventually(lambda: motors.getV() == 0.0)


def test_the_command_waits_for_ros_and_ends_cleanly_at_ctrl_c(shared: Robot) -> None:
    router = free_endpoint()
    options = ("--domain", "7", "--name", "red", "--ros", router)
    with command(shared.nao, *options, timeout=2.0) as process:
        process.wait_for(f"waiting for ROS: start `nao router` or rmw_zenohd.*nothing answers at {router}")
        with routing(Settings(mode="router", connect=(), listen=(router,))):
            process.wait_for(r"^ready: /red, ", START_LIMIT)
            with Node("tool", domain=7, settings=settings(router)) as ros:
                eventually(lambda: "/red" in ros.graph.nodes())
            process.process.send_signal(signal.SIGINT)
            assert process.wait() == 130
        assert process.output.count("\n") == 2, process.output


def test_the_command_ends_while_it_waits_for_ros(shared: Robot) -> None:
    with command(shared.nao, "--ros", free_endpoint(), timeout=2.0) as process:
        process.wait_for("waiting for ROS: ")
        process.process.send_signal(signal.SIGINT)
        assert process.wait(END_LIMIT) == 130
        assert "Traceback" not in process.output


def test_a_name_that_no_node_may_have_is_refused(shared: Robot) -> None:
    where = ("--connect", shared.nao.endpoint, "--realm", shared.nao.realm)
    wrong = run_here(app, "naoserver-ros2", *where, "--name", "no name", expected=EXPECTED)
    assert wrong.returncode == 1
    assert "no name" in wrong.stderr


def test_it_goes_on_when_the_robot_server_was_restarted() -> None:
    endpoint = free_endpoint()
    with ExitStack() as first:
        server = first.enter_context(served(FakeRobot(), realm="again", endpoint=endpoint))
        with (
            server.client(limits=AT_ONCE) as client,
            serve(client.communicator, "nao", settings=settings(endpoint)) as telemetry,
            Node("tester", settings=settings(endpoint)) as ros,
        ):
            states = ros.create_subscription("sensor_msgs/msg/JointState", "/joint_states")

            def goes_on(after: float) -> bool:
                telemetry.poll()
                sample = states.latest()
                return sample is not None and sample.wall_time > after

            eventually(lambda: goes_on(0.0))
            first.close()
            with served(FakeRobot(), realm="again", endpoint=endpoint):
                begun = time.time()
                eventually(lambda: goes_on(begun))


def test_without_a_robot_server_it_says_so() -> None:
    result = run_here(
        app, "naoserver-ros2", "--connect", free_endpoint(), "--timeout", "0.3", expected=EXPECTED
    )
    assert result.returncode == 1
    assert "naoserver-ros2: error: nothing answers at " in result.stderr
    assert (result.stdout + result.stderr).count("\n") == 1
