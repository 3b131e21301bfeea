"""Commands from ROS: topics, actions, services and parameters, each executed by servants of the robot server.

Watchdog, lease, emergency stop and the limits of joints thus apply as for any other client, and motion that
the gateway drives stops when it dies. Refusals are logged, with the joint's name.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from msgspec.structs import replace

from interfaces import nao
from interfaces.jderobot import CameraDescription, CameraPrx, EncodersPrx, MotorsPrx
from naoserver.bodies.body import Body
from visualhfsm_ros2.gateway import _trajectory as trajectory
from visualhfsm_ros2.gateway._description import DescribedRobot
from visualhfsm_ros2.gateway._frames import FOOTPRINT, ODOM, ROOT
from visualhfsm_ros2.gateway._messages import Stamps
from visualhfsm_ros2.gateway._telemetry import camera_topics
from visualhfsm_ros2.gateway._trajectory import TrajectoryTopic
from visualhfsm_ros2.gateway._vigil import JointMotion, Vigil, WalkMotion
from zenoh_ice import SystemException, UserException
from zenoh_ros2 import (
    LARGEST_COMMAND,
    Aborted,
    ActionServer,
    Canceled,
    Node,
    Parameters,
    QoS,
    Sender,
    ServerGoal,
)

_LINEAR: Final = 1.0
_TURNING: Final = 2.0

_logger = logging.getLogger(__name__)


class Speeds:
    """The highest speeds of /cmd_vel, beside the robot server's own limits."""

    def __init__(self) -> None:
        self.linear = _LINEAR
        """In m/s, along the ground."""
        self.turning = _TURNING
        """In rad/s."""

    def change(self, kind: str, speed: float) -> None:
        """Set the speed of a kind, `linear` or `turning`. Raises ValueError unless it is above 0."""
        if not 0.0 < speed < math.inf:
            raise ValueError(f"{speed} is no speed above 0")
        setattr(self, kind, speed)

    def limited(self, forward: float, left: float, turn: float) -> tuple[float, float, float]:
        """Return a velocity scaled to the speeds: its path keeps its form."""
        excess = max(math.hypot(forward, left) / self.linear, abs(turn) / self.turning, 1.0)
        return forward / excess, left / excess, turn / excess


def declare_parameters(node: Node, robot: DescribedRobot, stamps: Stamps) -> Speeds:
    """Serve the node's parameters; return the speeds, which they set."""
    parameters, speeds = Parameters(node), Speeds()
    simulated = "Whether stamps are those of the topic clock, as the robot server decides."
    parameters.declare("use_sim_time", stamps.simulated, simulated, read_only=True)
    prefix = "What the names of the robot's frames begin with."
    parameters.declare("frame_prefix", stamps.frame_prefix, prefix, read_only=True)

    own = "beside the robot's own limits; what exceeds one is scaled as a whole."
    parameters.declare(
        "walk.max_linear_speed", _LINEAR, f"Highest speed of /cmd_vel in m/s, {own}",
        on_change=partial(speeds.change, "linear"),
    )  # fmt: skip
    parameters.declare(
        "walk.max_turning_speed", _TURNING, f"Highest turning speed of /cmd_vel in rad/s, {own}",
        on_change=partial(speeds.change, "turning"),
    )  # fmt: skip
    for identity, topic in camera_topics(robot.body).items():
        camera = robot.find(CameraPrx, identity)
        if camera is not None:
            _CameraParameters(camera).declare(parameters, topic.replace("/", "."))
    return speeds


class _CameraParameters:
    """Size and rate of one camera, which all its clients share: the robot server has them."""

    def __init__(self, camera: CameraPrx) -> None:
        self._camera: Final = camera
        self._lock: Final = threading.Lock()
        self._known: CameraDescription = camera.getCameraDescription()

    def declare(self, parameters: Parameters, name: str) -> None:
        """Declare the parameters, whose names begin with that of the camera."""
        shared = "which all clients of the robot server share"
        parameters.declare(
            f"{name}.image_size", self.size(), f"Width and height of images in pixels, {shared}.",
            on_change=self.resize, read=self.size,
        )  # fmt: skip
        parameters.declare(
            f"{name}.frame_rate", self.rate(), f"Images in a second of robot time, {shared}.",
            on_change=lambda rate: self._change(rate=rate), read=self.rate,
        )  # fmt: skip

    def size(self) -> list[int]:
        now = self._described()
        return [now.width, now.height]

    def rate(self) -> float:
        return self._described().rate

    def resize(self, size: list[int]) -> None:
        if len(size) != 2:
            raise ValueError(f"{size}: width and height are needed, such as [640, 480]")
        self._change(width=size[0], height=size[1])

    def _change(self, **settings: float) -> None:
        with self._lock:
            try:
                taken = self._camera.setCameraDescription(replace(self._described(), **settings))
            except (UserException, SystemException) as error:
                raise ValueError(str(error)) from error
        if taken != 0:
            raise ValueError("the camera has no such setting")

    def _described(self) -> CameraDescription:
        """Return the present description; the last one known while the server does not answer."""
        try:
            self._known = self._camera.getCameraDescription()
        except SystemException as error:
            _logger.debug("a camera's parameters: %s", error)
        return self._known


_TWIST: Final = "geometry_msgs/msg/Twist"
_STAMPED: Final = "geometry_msgs/msg/TwistStamped"
_NEWEST: Final = QoS(depth=1)
_FULL_PACE: Final = 1.0
_CHECK_PERIOD: Final = 0.05
"""Wall seconds between two checks of a motion, a posture or speech."""
_SILENCE: Final = 1.0
"""Wall seconds of silence after which a text that was not begun is taken as dropped."""
_ATTEMPTS: Final = 3
"""Number of attempts to begin a motion while others begin the same one."""
_LARGEST_TRAJECTORY: Final = 4 << 20
"""Maximum bytes of the goal of a trajectory: 10,000 points of all joints."""
_LOG_PERIOD: Final = 1.0
"""Wall seconds in which the same refusal is logged only once."""
_MOST_REFUSALS: Final = 10
"""Maximum refusals that are logged in that time."""


class RefusedError(Exception):
    """A message from ROS has an invalid request."""


_REFUSALS: Final = (RefusedError, trajectory.TrajectoryError, UserException, SystemException)


class Commands:
    """Serves a node's commands to a robot, as far as the robot supports them."""

    def __init__(self, node: Node, robot: DescribedRobot, stamps: Stamps, speeds: Speeds) -> None:
        """Serve the commands of a node; `speeds` limits those of /cmd_vel."""
        self._node: Final = node
        self._speeds: Final = speeds
        self._odom, self._root, self._footprint = (
            stamps.frame_prefix + each for each in (ODOM, ROOT, FOOTPRINT)
        )
        self._refusals: deque[tuple[str, float]] = deque(maxlen=_MOST_REFUSALS)
        self._body = robot.require(nao.JointsPrx, "Body")
        self._names: Final = robot.body.joint_names
        self._chains: Final = _chains(robot.body)
        self._safety = robot.require(nao.SafetyPrx, "Safety")
        motors = robot.find(MotorsPrx, "Motors")
        walk, encoders = robot.find(nao.WalkPrx, "Walk"), robot.find(EncodersPrx, "Encoders")
        speech = robot.find(nao.SpeechPrx, "Speech")
        postures = robot.find(nao.PosturesPrx, "Postures")
        motions = robot.find(nao.MotionsPrx, "Motions")

        self.emergency_stop: Final = node.create_service(
            "std_srvs/srv/Trigger", "~/emergency_stop", self._stop, urgent=True
        )
        node.create_service("std_srvs/srv/Trigger", "~/reset", self._reset, urgent=True)
        node.create_service("std_srvs/srv/Trigger", "~/resume", self._resume, urgent=True)
        self._vigil: Final = Vigil()
        node.on_close(self._vigil, self._vigil.close)
        self._joint_motion: Final = JointMotion(self._body, self._names)
        self._listen("naoqi_bridge_msgs/msg/JointAnglesWithSpeed", "joint_angles", self._move)
        follower = trajectory.TrajectoryFollower(self._body, stamps.robot_time, self._stops)
        ActionServer(
            node,
            trajectory.TYPE,
            "joint_trajectory_controller/follow_joint_trajectory",
            follower.execute,
            largest_goal=_LARGEST_TRAJECTORY,
            needs_client=True,
        )
        topic = "joint_trajectory_controller/joint_trajectory"
        followed = TrajectoryTopic(node.types, follower, partial(self._refuse, topic))
        node.on_close(followed, followed.close)
        self._listen(trajectory.MESSAGE, topic, followed.receive, _NEWEST, largest=_LARGEST_TRAJECTORY)
        if motors is not None:
            self._motors = motors
            for kind, drive in ((_TWIST, self._drive), (_STAMPED, self._drive_stamped)):
                self._listen(kind, "cmd_vel", drive, _NEWEST, besides=(_TWIST, _STAMPED))
        if walk is not None and encoders is not None:
            self._walk, self._encoders = walk, encoders
            self._listen("geometry_msgs/msg/PoseStamped", "move_base_simple/goal", self._go, _NEWEST)
        if speech is not None:
            self._speech = speech
            self._listen("std_msgs/msg/String", "speech", lambda message, _: speech.say(message.data))
            self._serve("SpeechWithFeedback", "speech_action", self._say)
        if postures is not None:
            self._postures = postures
            self._serve(
                "BodyPose", "body_pose", lambda goal: self._pose(goal, goal.request.pose_name, _FULL_PACE)
            )
            self._serve(
                "BodyPoseWithSpeed",
                "body_pose_naoqi",
                lambda goal: self._pose(goal, goal.request.posture_name, goal.request.speed),
            )
        if motions is not None:
            self._motions = motions
            self._serve("RunBehavior", "run_behavior", self._play, needs_client=True)

    # -- topics ------------------------------------------------------------------------------------------

    def _listen(
        self,
        type_name: str,
        name: str,
        handle: Callable[[Any, Sender], object],
        qos: QoS = QoS(),  # noqa: B008
        *,
        largest: int = LARGEST_COMMAND,
        besides: Sequence[str] = (),
    ) -> None:
        def receive(message: Any, sender: Sender) -> None:  # noqa: ANN401 - its class is made at run time
            try:
                handle(message, sender)
            except _REFUSALS as error:
                self._refuse(name, str(error))

        self._node.create_subscription(
            type_name, name, receive, qos, largest=largest, with_sender=True, besides=besides
        )

    def _refuse(self, name: str, why: str) -> None:
        """Log why a message was refused: each reason once, and at most ten in a second."""
        now = time.monotonic()
        recent = [text for text, logged in tuple(self._refusals) if now - logged < _LOG_PERIOD]
        if why not in recent and len(recent) < _MOST_REFUSALS:
            self._refusals.append((why, now))
            _logger.warning("/%s: refused: %s", name, why)

    def _drive(self, twist: Any, _: Sender) -> None:  # noqa: ANN401
        """Walk at a velocity until the next message; the server stops the walk 0.5 s after the last one."""
        velocity = {"linear.x": twist.linear.x, "linear.y": twist.linear.y, "angular.z": twist.angular.z}
        for field, value in velocity.items():
            if not math.isfinite(value):
                raise RefusedError(f"{field} is {value}: it must be a finite number")
        forward, left, turn = self._speeds.limited(*velocity.values())
        motors = self._motors
        for call in (motors.setV.begin(forward), motors.setL.begin(left), motors.setW.begin(turn)):
            call.result()  # within the proxy's limit

    def _drive_stamped(self, message: Any, sender: Sender) -> None:  # noqa: ANN401
        """Walk at a velocity as Nav2 and ros2_control send it; that it is renewed counts, not its stamp."""
        frame = message.header.frame_id
        if frame not in ("", self._root, self._footprint):
            raise RefusedError(f"the frame is {frame[:64]!r}: it must be {self._root} or {self._footprint}")
        self._drive(message.twist, sender)

    def _go(self, message: Any, sender: Sender) -> None:  # noqa: ANN401
        """Walk to a place in the frame odom or base_footprint, while the publisher exists."""
        place, turn, frame = message.pose.position, message.pose.orientation, message.header.frame_id
        sine = 2.0 * (turn.w * turn.z + turn.x * turn.y)
        cosine = 1.0 - 2.0 * (turn.y * turn.y + turn.z * turn.z)
        x, y, heading = place.x, place.y, math.atan2(sine, cosine)
        if not (math.isfinite(x) and math.isfinite(y)):
            raise RefusedError("the place is not a finite number")
        if not (math.isfinite(sine) and math.isfinite(cosine)):  # infinite ones would give a finite heading
            raise RefusedError("the orientation is not a finite number")
        if frame == self._odom:
            here = self._encoders.getEncodersData()
            x, y = x - here.robotx, y - here.roboty
            x, y = here.robotcos * x + here.robotsin * y, here.robotcos * y - here.robotsin * x
            heading = math.remainder(heading - here.robottheta, math.tau)
        elif frame != self._footprint:
            raise RefusedError(f"the frame is {frame[:64]!r}: it must be {self._odom} or {self._footprint}")
        self._walk.walkTo(x, y, heading)
        self._vigil.watch(WalkMotion(self._walk, self._walk.getWalkState().count, sender))

    def _move(self, message: Any, sender: Sender) -> None:  # noqa: ANN401
        """Send joints to angles at a fraction of their speed, while the publisher exists.

        The angles are as in ALMotion's setAngles and changeAngles.
        """
        given = message.joint_names
        if len(given) > len(self._names):
            raise RefusedError(f"{len(given)} joints; there are {len(self._names)}")
        names = self._chains.get(given[0], given) if len(given) == 1 else given
        if len(names) != len(message.joint_angles) or len(set(names)) != len(names):
            raise RefusedError(f"{len(message.joint_angles)} angles for {len(names)} joints, each once")
        targets = dict(zip(names, message.joint_angles.tolist(), strict=True))
        for name, angle in targets.items():
            if name not in self._names:
                raise RefusedError(f"there is no joint {name[:64]!r}; there are {', '.join(self._names)}")
            if not math.isfinite(angle):
                raise RefusedError(f"{name} is {angle}: it must be a finite number")
        if message.relative:
            commands = dict(zip(self._names, self._body.getJointState().commands, strict=True))
            targets = {name: commands[name] + angle for name, angle in targets.items()}
        limited = self._body.setJointPositions(targets, message.speed)
        self._joint_motion.add(limited, sender)
        self._vigil.watch(self._joint_motion)

    # -- actions -----------------------------------------------------------------------------------------

    def _serve(
        self, kind: str, name: str, act: Callable[[ServerGoal], None], *, needs_client: bool = False
    ) -> None:
        def execute(goal: ServerGoal) -> None:
            try:
                act(goal)
            except (UserException, SystemException) as error:
                raise Aborted(str(error)) from error

        ActionServer(self._node, f"naoqi_bridge_msgs/action/{kind}", name, execute, needs_client=needs_client)

    def _pose(self, goal: ServerGoal, name: str, fraction: float) -> None:
        of = self._postures
        _act(goal, name, of.getPostureState, lambda: of.goToPosture(name, fraction), of.stop)

    def _play(self, goal: ServerGoal) -> None:
        of, name = self._motions, goal.request.behavior
        _act(goal, name, of.getMotionState, lambda: of.play(name, _FULL_PACE), of.stop)

    def _say(self, goal: ServerGoal) -> None:
        """Say a text after those that wait, until it has been said or dropped."""
        before, heard = self._speech.getSpeech(), time.monotonic()
        self._speech.say(goal.request.say)
        own: int | None = None  # the count of the goal's text, once it is being said
        while True:
            now = self._speech.getSpeech()
            if own is None and now.count != before.count and now.text == goal.request.say:
                own = now.count
            if own is not None and (now.count != own or not now.speaking):
                return
            if now.speaking:
                heard = time.monotonic()
            elif now.count != before.count:
                return
            elif time.monotonic() - heard > _SILENCE:
                raise Aborted("the text was dropped: somebody stopped the speech")
            if goal.wait(_CHECK_PERIOD):
                self._speech.stop()
                raise Canceled

    # -- services ----------------------------------------------------------------------------------------

    def _stops(self) -> tuple[str, int]:
        """Return the server of the robot, and how often it was stopped since that began."""
        state = self._safety.getSafetyState()
        return state.session, state.stops

    def _stop(self, _request: object) -> dict[str, object]:
        return self._answer(lambda: self._safety.emergencyStop("emergency stop from ROS"), "stopped")

    def _reset(self, _request: object) -> dict[str, object]:
        return self._answer(self._safety.resetEmergencyStop, "programs that are started now may command")

    def _resume(self, _request: object) -> dict[str, object]:
        return self._answer(lambda: self._safety.resetEmergencyStop(True), "all that was stopped may go on")

    @staticmethod
    def _answer(act: Callable[[], None], done: str) -> dict[str, object]:
        try:
            act()
        except (UserException, SystemException) as error:
            _logger.error("%s", error)
            return {"success": False, "message": str(error)}
        return {"success": True, "message": done}


def _chains(body: Body) -> Mapping[str, Sequence[str]]:
    """Return the joints of NAOqi's chains, as far as the body has them."""
    groups = body.groups
    chains = {
        "Body": body.joint_names,
        "Head": groups.head,
        "LArm": groups.left_arm,
        "RArm": groups.right_arm,
        "LLeg": groups.left_leg,
        "RLeg": groups.right_leg,
    }
    return {name: joints for name, joints in chains.items() if joints}


def _begin(name: str, state: Callable[[], nao.ActionState], begin: Callable[[], None]) -> int:
    """Begin a motion or a posture and return its count; raises Aborted when another one took its place.

    Another client may begin one at the same moment. If it has the same name, only beginning again shows whose
    it is: then the newest is ours.
    """
    for _ in range(_ATTEMPTS):
        before = state().count
        begin()
        now = state()
        if now.name != name:
            break
        if now.count == before + 1:
            return now.count
    raise Aborted(f"{now.name} was begun instead")


def _act(
    goal: ServerGoal,
    name: str,
    state: Callable[[], nao.ActionState],
    begin: Callable[[], None],
    stop: Callable[[], None],
) -> None:
    """Begin a motion or a posture, and wait for its end; stop it when the goal is cancelled."""
    count = _begin(name, state, begin)
    while True:
        now = state()
        if now.count != count:
            raise Aborted(f"{now.name} was begun instead")
        if now.status is nao.ActionStatus.Done:
            return
        if now.status in (nao.ActionStatus.Stopped, nao.ActionStatus.Failed):
            raise Aborted(now.message or now.status.name.lower())
        if goal.wait(_CHECK_PERIOD):
            stop()
            raise Canceled
