"""The parameters of the gateway's node: its time, its cameras, and the highest speeds of /cmd_vel."""

from __future__ import annotations

import logging
import math
import threading
from typing import Final

from interfaces.jderobot import CameraDescription, CameraPrx
from zenoh_ice import SystemException, UserException
from zenoh_ros2 import Node, Parameters

from ._description import DescribedRobot
from ._messages import Stamps
from ._telemetry import camera_topics

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

    def set_linear(speed: float) -> None:
        speeds.linear = _speed(speed)

    def set_turning(speed: float) -> None:
        speeds.turning = _speed(speed)

    own = "beside the robot's own limits; what exceeds one is scaled as a whole."
    parameters.declare(
        "walk.max_linear_speed", _LINEAR, f"Highest speed of /cmd_vel in m/s, {own}", on_change=set_linear
    )
    parameters.declare(
        "walk.max_turning_speed", _TURNING, f"Highest turning speed of /cmd_vel in rad/s, {own}",
        on_change=set_turning,
    )  # fmt: skip
    for identity, topic in camera_topics(robot.body).items():
        camera = robot.find(CameraPrx, identity)
        if camera is not None:
            _CameraParameters(camera).declare(parameters, topic.replace("/", "."))
    return speeds


def _speed(speed: float) -> float:
    if not 0.0 < speed < math.inf:
        raise ValueError(f"{speed} is no speed above 0")
    return speed


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
            on_change=self.pace, read=self.rate,
        )  # fmt: skip

    def size(self) -> list[int]:
        now = self._described()
        return [now.width, now.height]

    def rate(self) -> float:
        return self._described().rate

    def resize(self, size: list[int]) -> None:
        if len(size) != 2:
            raise ValueError(f"{size}: width and height are needed, such as [640, 480]")
        with self._lock:
            now = self._described()
            now.width, now.height = size
            self._set(now)

    def pace(self, rate: float) -> None:
        with self._lock:
            now = self._described()
            now.rate = rate
            self._set(now)

    def _described(self) -> CameraDescription:
        """Return the present description; the last one known while the server does not answer."""
        try:
            self._known = self._camera.getCameraDescription()
        except SystemException as error:
            _logger.debug("a camera's parameters: %s", error)
        return self._known

    def _set(self, wanted: CameraDescription) -> None:
        try:
            taken = self._camera.setCameraDescription(wanted)
        except (UserException, SystemException) as error:
            raise ValueError(str(error)) from error
        if taken != 0:
            raise ValueError("the camera has no such setting")
