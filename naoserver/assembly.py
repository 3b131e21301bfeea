"""The servants of a robot and the safety layer below them, before they are served: no threads, no network."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from naoserver.body import H25
from naoserver.errors import RobotError
from naoserver.event_log import EventLog
from naoserver.guarded_device import GuardedDevice
from naoserver.hinges import HINGES, Hinge, ball_hinge
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.robot import JointDevice, Robot
from naoserver.safety import Safety
from naoserver.servants.body import JointsI
from naoserver.servants.camera import CameraI
from naoserver.servants.clock import ClockI
from naoserver.servants.head import PoseHeadI
from naoserver.servants.health import HealthI
from naoserver.servants.hinge import Pose3DEncodersI, Pose3DMotorsI
from naoserver.servants.neck_speed import NeckSpeedI
from naoserver.servants.streaming import StreamsState
from zenoh_ice import Object


class Assembly:
    """What stands between a robot and its clients.

    `wall_time` is the steady clock of the safety deadlines; `look_within` is told in how many of its seconds
    `GuardedDevice.watch` is due after a command. Raises RobotError when the options ask for what the robot
    cannot do.
    """

    def __init__(
        self,
        robot: Robot,
        options: ServerOptions,
        wall_time: Callable[[], float],
        look_within: Callable[[float], None],
    ) -> None:
        self._wall_time = wall_time
        self._look_within = look_within
        self.servants: Final[dict[str, Object]] = {}
        """Every servant by its identity."""
        self.streams: Final[list[StreamsState]] = []
        """The servants that stream the state of joints."""
        self.events: Final = EventLog(robot.clock.now, wall_time)
        """What an operator should know, as the health report tells it."""

        body = self._guard(robot, options.safety)
        self.devices: Final = [body]
        """The robot, and the mechanisms beside it."""
        for hinge in HINGES:
            self._add_hinge(body, hinge)
        for mechanism in robot.mechanisms:
            device = self._guard(mechanism, options.mechanism_safety)
            self.devices.append(device)
            self._add_hinge(device, ball_hinge(mechanism.name, tuple(j.name for j in mechanism.joints)))
        self.servants["NeckSpeed"] = NeckSpeedI(body)
        head, joints = PoseHeadI(body), JointsI(body)
        self.servants.update({"Head": head, "Body": joints})
        self.streams.extend((head, joints))
        self.cameras: Final = self._make_cameras(robot, options)
        self.clock: Final = ClockI(robot.clock)
        self.health: Final = HealthI(
            robot,
            self.events,
            lambda: {camera.facts.name: camera.delivered_rate for camera in self.cameras},
            wall_time,
        )
        self.servants.update({"Clock": self.clock, "Health": self.health})

    def _make_cameras(self, robot: Robot, options: ServerOptions) -> list[CameraI]:
        unknown = options.cameras.keys() - {facts.name for facts in robot.cameras}
        if unknown:
            names = ", ".join(facts.name for facts in robot.cameras)
            raise RobotError(f"there is no camera {sorted(unknown)[0]!r}; there are {names}")
        cameras = [
            CameraI(robot, facts, options.cameras.get(facts.name, options.camera), self.events)
            for facts in robot.cameras
        ]
        self.servants.update({camera.facts.name: camera for camera in cameras})
        return cameras

    def _guard(self, device: JointDevice, options: SafetyOptions) -> GuardedDevice:
        own = {joint.name for joint in device.joints}
        safety = Safety(
            device.joints,
            options,
            [table for table in H25.anticollision if {table.independent, table.dependent} <= own],
            [pair for pair in H25.couplings if {pair.leader, pair.follower} <= own],
        )
        return GuardedDevice(device, safety, self.events, self._wall_time, self._look_within)

    def _add_hinge(self, device: GuardedDevice, hinge: Hinge) -> None:
        self.servants[f"{hinge.name}Motors"] = Pose3DMotorsI(device, hinge)
        encoders = Pose3DEncodersI(device, hinge)
        self.servants[f"{hinge.name}Encoders"] = encoders
        self.streams.append(encoders)
