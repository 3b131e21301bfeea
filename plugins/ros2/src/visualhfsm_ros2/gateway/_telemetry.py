"""Reports of the robot as topics; without listeners, data is neither requested nor published."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final, NamedTuple, TypeVar

from interfaces import nao
from interfaces.jderobot import CameraPrx, EncodersPrx, ImageData
from naoserver.bodies.body import Body
from visualhfsm_ros2.gateway import _messages as messages
from visualhfsm_ros2.gateway._description import DescribedRobot
from visualhfsm_ros2.gateway._frames import (
    ODOM,
    OUTSIDE,
    ROOT,
    SOLES,
    camera_frame,
    optical_frame,
    outside_frames,
    urdf,
)
from visualhfsm_ros2.gateway._messages import BodyFrames, Fields, Stamps
from visualhfsm_ros2.gateway._sight import detections
from zenoh_ice import Sample, Subscription
from zenoh_ice.objects.proxy import StreamedCall
from zenoh_ros2 import LATCHED, Node, Publisher, QoS

CLOCK: Final = "clock"
"""The topic of the time: robots in namespaces have a time each, because simulations differ in it."""
_ONCE_A_SECOND: Final = 1.0
_EVENTS: Final = 64
"""Maximum changes of the touch sensors that wait."""

V = TypeVar("V")

_logger = logging.getLogger(__name__)


class Output(NamedTuple):
    """A topic made from the samples of a stream."""

    type_name: str
    name: str
    frame: str
    fields: Callable[[Fields, Any], Fields]
    """Returns the message's fields from its header and a sample's value."""


class _Topic:
    """A topic, and whether it had listeners at the last check."""

    def __init__(self, publisher: Publisher) -> None:
        self._publisher: Final = publisher
        self.publish: Final = publisher.publish
        self.wanted = False

    def poll(self) -> None:
        self.wanted = self._publisher.heard


class _Relay:
    """Follows a stream of the robot while one of the topics made from it has listeners."""

    def __init__(self, topics: Sequence[_Topic], follow: Callable[[], Subscription[Any]]) -> None:
        self._topics = topics
        self._follow = follow
        self._following: Subscription[Any] | None = None

    def poll(self) -> None:
        for topic in self._topics:
            topic.poll()
        if not any(topic.wanted for topic in self._topics):
            self.close()
        elif self._following is None:
            self._following = self._follow()

    def close(self) -> None:
        following, self._following = self._following, None
        if following is not None:
            following.close()


class Telemetry:
    """Publishes the streams of a robot server; `poll` is to be called several times a second."""

    def __init__(self, node: Node, robot: DescribedRobot, stamps: Stamps) -> None:
        """Announce topics for the robot's servants. Raises SystemException when the server is gone."""
        self._node: Final = node
        self._robot: Final = robot
        self._stamps: Final = stamps
        self._relays: Final[list[_Relay]] = []
        self._inertial = robot.find(nao.InertialUnitPrx, "InertialUnit")
        self._encoders = robot.find(EncodersPrx, "Encoders")
        self._joints = robot.require(nao.JointsPrx, "Body")
        self._body: Final = robot.body
        self._names: Final = robot.body.joint_names
        clock = robot.require(nao.ClockPrx, "Clock")
        self._clocks: Final = node.publishers(CLOCK) if stamps.simulated else None
        self._jumps = False
        if stamps.simulated:
            time = Output("rosgraph_msgs/msg/Clock", CLOCK, "", lambda header, _: {"clock": header["stamp"]})
            self._show(clock.getTime, time)
        self._add_body()
        self._add_senses()
        self._add_touch()
        for identity, topic in camera_topics(robot.body).items():
            self._add_camera(identity, topic)
        self._add_sight()
        self._adjusting = clock.getTime.subscribe(
            lambda sample: stamps.adjust(sample.time, sample.wall_time), rate=_ONCE_A_SECOND
        )

    def poll(self) -> None:
        """Follow just the streams whose topics have listeners."""
        for relay in self._relays:
            relay.poll()
        if self._clocks is not None:
            several = len(self._clocks) > 1
            if several and not self._jumps:
                names = ", ".join(sorted({each.node_name for each in self._clocks.all()}))
                where = self._node.resolve(CLOCK)
                _logger.warning(
                    "%s has several publishers: %s. It jumps where their times differ:"
                    " give each robot a --namespace, or this one --remap clock:=OTHER", where, names,
                )  # fmt: skip
            self._jumps = several

    def close(self) -> None:
        """End all streams."""
        self._adjusting.close()
        for relay in self._relays:
            relay.close()

    def _topic(self, type_name: str, name: str, qos: QoS = QoS()) -> _Topic:  # noqa: B008
        return _Topic(self._node.create_publisher(type_name, name, qos))

    def _show(self, stream: StreamedCall[..., V], *outputs: Output) -> None:
        """Publish topics from a stream."""
        topics = [(self._topic(output.type_name, output.name), output) for output in outputs]

        def publish(sample: Sample[V]) -> None:
            for topic, output in topics:
                if topic.wanted:
                    topic.publish(output.fields(self._stamps.header(sample.time, output.frame), sample.value))

        self._relays.append(_Relay([topic for topic, _ in topics], lambda: stream.subscribe(publish)))

    def _add_body(self) -> None:
        stamps, prefix = self._stamps, self._stamps.frame_prefix
        frames = BodyFrames(self._node.types, self._body, prefix)
        description = self._node.create_publisher("std_msgs/msg/String", "robot_description", LATCHED)
        description.publish(data=urdf(self._body, prefix))
        fixed = self._node.create_publisher("tf2_msgs/msg/TFMessage", "/tf_static", LATCHED)
        outside = self._robot.find(CameraPrx, OUTSIDE)
        beside = outside_frames(outside.getCameraDescription()) if outside else ()
        fixed.publish(frames.fixed(stamps.ns(self._joints.getJointState().time), beside))
        states = self._topic("sensor_msgs/msg/JointState", "joint_states")
        tf = self._topic("tf2_msgs/msg/TFMessage", "/tf", QoS(depth=100))
        odom = self._topic("nav_msgs/msg/Odometry", "odom") if self._encoders else None

        def publish(sample: Sample[nao.JointState]) -> None:
            state, header = sample.value, stamps.header(sample.time)
            if states.wanted:
                states.publish(messages.joint_state(header, self._names, state))
            if not tf.wanted and not (odom and odom.wanted):
                return
            inertial = _newest(self._inertial.getInertialReading) if self._inertial else None
            tilt = (inertial.roll, inertial.pitch) if inertial else (0.0, 0.0)
            moved = _newest(self._encoders.getEncodersData) if self._encoders else None
            ns = stamps.ns(sample.time)
            floor, place = frames.floor(ns, state.positions, tilt, moved)
            if tf.wanted:
                tf.publish(frames.message([*frames.moving(ns, state.positions), *floor]))
            if odom is not None and odom.wanted and moved is not None:
                header = stamps.header(sample.time, ODOM)
                odom.publish(frames.odometry(header, sample.time, place, moved))

        topics = [states, tf, *([odom] if odom else [])]
        self._relays.append(_Relay(topics, lambda: self._joints.getJointState.subscribe(publish)))

    def _add_senses(self) -> None:
        if self._inertial is not None:
            imu = Output("sensor_msgs/msg/Imu", "imu/torso", ROOT, messages.imu)
            self._show(self._inertial.getInertialReading, imu)
        if (sonar := self._robot.find(nao.SonarPrx, "Sonar")) is not None:
            kind, limits = "sensor_msgs/msg/Range", sonar.getSonarLimits()
            self._show(
                sonar.getSonarReading,
                Output(
                    kind, "sonar/left", "LSonar_frame", lambda to, at: messages.sonar(to, at.left, limits)
                ),
                Output(
                    kind, "sonar/right", "RSonar_frame", lambda to, at: messages.sonar(to, at.right, limits)
                ),
            )
        if (feet := self._robot.find(nao.FootPressurePrx, "FootPressure")) is not None:
            kind = "naoqi_bridge_msgs/msg/FloatArrayStamped"
            self._show(
                feet.getFeetReading,
                Output(kind, "fsr/left", SOLES[0], lambda to, felt: messages.foot(to, felt.left)),
                Output(kind, "fsr/right", SOLES[1], lambda to, felt: messages.foot(to, felt.right)),
            )
        if (battery := self._robot.find(nao.BatteryPrx, "Battery")) is not None:
            power = Output("sensor_msgs/msg/BatteryState", "battery_state", "", messages.battery)
            self._show(battery.getBatteryReading, power)
        if (health := self._robot.find(nao.HealthPrx, "Health")) is not None:
            safety = self._robot.require(nao.SafetyPrx, "Safety")

            def diagnose(header: Fields, report: nao.HealthReport) -> Fields:
                power = battery.getBatteryReading() if battery else None
                joints = self._names, self._joints.getJointState()
                return messages.diagnostics(header, report, safety.getSafetyState(), joints, power)

            self._show(
                health.getHealth, Output("diagnostic_msgs/msg/DiagnosticArray", "/diagnostics", "", diagnose)
            )

    def _add_touch(self) -> None:
        touch = self._robot.find(nao.TouchPrx, "Touch")
        if touch is None:
            return
        kinds = messages.touch_kinds(touch.getTouchNames())
        topics = {name: self._topic(f"naoqi_bridge_msgs/msg/{kind}", name) for name, kind in kinds.items()}
        before: frozenset[str] = frozenset()

        def publish(sample: Sample[nao.TouchReading]) -> None:
            nonlocal before
            touched = frozenset(sample.value.touched)
            for name, fields in messages.touch_events(before, touched):
                topics[name].publish(fields)
            before = touched

        follow = touch.getTouchReading.subscribe
        self._relays.append(_Relay([*topics.values()], lambda: follow(publish, queue=_EVENTS)))

    def _add_camera(self, identity: str, topic: str) -> None:
        camera = self._robot.find(CameraPrx, identity)
        if camera is None:
            return
        own = next((each for each in self._body.cameras if each.name == identity), None)
        frame, described = optical_frame(camera_frame(own, identity)), camera.getCameraDescription()

        def info(header: Fields, image: ImageData) -> Fields:
            nonlocal described
            if described.width != image.description.width:  # a client has set another size
                described = camera.getCameraDescription()
            return messages.camera_info(header, described)

        raw, compressed = f"{topic}/image_raw", "sensor_msgs/msg/CompressedImage"
        self._show(
            camera.getImageData,
            Output("sensor_msgs/msg/Image", raw, frame, messages.raw_image),
            Output("sensor_msgs/msg/CameraInfo", f"{topic}/camera_info", frame, info),
            Output(compressed, f"{raw}/compressed", frame, messages.compressed_image),
        )

    def _add_sight(self) -> None:
        sight, topics = self._robot.find(nao.SightPrx, "Sight"), camera_topics(self._body)
        if sight is None:
            return
        kind = "vision_msgs/msg/Detection3DArray"
        outputs = [
            Output(
                kind,
                f"{topics[camera.name]}/detections",
                optical_frame(camera_frame(camera, camera.name)),
                partial(detections, camera.name, self._stamps),
            )
            for camera in self._body.cameras
        ]
        self._show(sight.getSight, *outputs)


def camera_topics(body: Body) -> dict[str, str]:
    """Return the beginning of the topics of each camera: `camera/bottom` for `CameraBottom`."""
    names = [camera.name for camera in body.cameras] + [OUTSIDE]
    return {name: f"camera/{name.removeprefix('Camera').lower() or 'front'}" for name in names}


def _newest(stream: StreamedCall[[], V]) -> V:
    """Return the newest value of a stream; only the first one needs a call."""
    sample = stream.latest()
    return stream() if sample is None else sample.value
