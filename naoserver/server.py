"""Serve a robot: its servants, the safety layer between them and the joints, and the threads that stream."""

from __future__ import annotations

import time
from contextlib import ExitStack
from types import TracebackType
from typing import Final, Self

from naoserver.body import H25
from naoserver.errors import RobotError
from naoserver.event_log import EventLog
from naoserver.guarded_device import GuardedDevice
from naoserver.hinges import HINGES, Hinge, ball_hinge
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.pumps import CameraPump, Pump, StatePump, WallPump
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
from naoserver.watchdog import Watchdog
from zenoh_ice import Object, ObjectAdapter


def serve(robot: Robot, adapter: ObjectAdapter, options: ServerOptions | None = None) -> RobotServer:
    """Serve a started robot on an adapter; the caller activates the adapter, and closes the robot afterwards.

    Raises RobotError when the options ask for what the robot cannot do.
    """
    return RobotServer(robot, adapter, options or ServerOptions())


class RobotServer:
    """The servants and threads that serve a robot; leaving the `with` block stops motion and ends them."""

    def __init__(self, robot: Robot, adapter: ObjectAdapter, options: ServerOptions) -> None:
        self._adapter = adapter
        self._servants: dict[str, Object] = {}
        self._served: list[str] = []
        self._streams: list[StreamsState] = []
        self._watchdog = Watchdog()
        self.events: Final = EventLog(robot.clock.now, time.monotonic)
        """What an operator should know, as the health report tells it."""

        body = self._guard(robot, options.safety)
        self._devices = [body]
        for hinge in HINGES:
            self._add_hinge(body, hinge)
        for mechanism in robot.mechanisms:
            device = self._guard(mechanism, options.mechanism_safety)
            self._devices.append(device)
            self._add_hinge(device, ball_hinge(mechanism.name, tuple(j.name for j in mechanism.joints)))
        self._servants["NeckSpeed"] = NeckSpeedI(body)
        head, joints = PoseHeadI(body), JointsI(body)
        self._servants |= {"Head": head, "Body": joints}
        self._streams += [head, joints]

        unknown = options.cameras.keys() - {facts.name for facts in robot.cameras}
        if unknown:
            names = ", ".join(facts.name for facts in robot.cameras)
            raise RobotError(f"there is no camera {sorted(unknown)[0]!r}; there are {names}")
        cameras = [
            CameraI(robot, facts, options.cameras.get(facts.name, options.camera), self.events)
            for facts in robot.cameras
        ]
        self._servants |= {camera.facts.name: camera for camera in cameras}
        clock = ClockI(robot.clock)
        health = HealthI(
            robot,
            self.events,
            lambda: {camera.facts.name: camera.delivered_rate for camera in cameras},
            time.monotonic,
        )
        self._servants |= {"Clock": clock, "Health": health}

        self._pumps: list[Pump] = [
            StatePump(robot.clock, options.state_rate, options.state_wall_rate, self._streams),
            WallPump("clock", options.clock_rate, clock.publish),
            WallPump("health", options.health_rate, health.publish),
            *(CameraPump(robot.clock, camera) for camera in cameras),
        ]
        self._start()

    def close(self) -> None:
        """Stop all motion, take the servants away and end the threads; does nothing the second time."""
        with ExitStack() as steps:  # run from the last to the first, each whatever the others raise
            for pump in self._pumps:
                steps.callback(pump.join)
            steps.callback(self._watchdog.close)
            steps.callback(self._clients.close)
            steps.callback(self._withdraw)
            for device in self._devices:
                steps.callback(device.close)
            for pump in self._pumps:
                steps.callback(pump.ask_to_stop)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _guard(self, device: JointDevice, options: SafetyOptions) -> GuardedDevice:
        own = {joint.name for joint in device.joints}
        safety = Safety(
            device.joints,
            options,
            [table for table in H25.anticollision if {table.independent, table.dependent} <= own],
            [pair for pair in H25.couplings if {pair.leader, pair.follower} <= own],
        )
        return GuardedDevice(device, safety, self.events, time.monotonic, self._watchdog.look_within)

    def _add_hinge(self, device: GuardedDevice, hinge: Hinge) -> None:
        self._servants[f"{hinge.name}Motors"] = Pose3DMotorsI(device, hinge)
        encoders = Pose3DEncodersI(device, hinge)
        self._servants[f"{hinge.name}Encoders"] = encoders
        self._streams.append(encoders)

    def _start(self) -> None:
        self._clients = self._adapter.getCommunicator().onClientLost(self._client_lost)
        try:
            self._watchdog.start(self._devices)
            for identity, servant in self._servants.items():
                self._adapter.add(servant, identity)
                self._served.append(identity)
            for pump in self._pumps:
                pump.start()
        except BaseException:
            self.close()
            raise

    def _withdraw(self) -> None:
        served, self._served = self._served, []
        self._adapter.removeAll(served)

    def _client_lost(self, client: str) -> None:
        for device in self._devices:
            device.drop_client(client)
