"""Servants of every robot server: its clock, its health, the gate in front of its commands, and its body."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Final

from interfaces.nao import Clock as ClockServant
from interfaces.nao import ClockReading, Description, Health, HealthReport, Safety, SafetyState
from naoserver.bodies.body import Body, write_body
from naoserver.protocol.robot import Robot
from naoserver.safety._event_log import ConditionWatch, JointWatch
from naoserver.safety._gate import Gate
from naoserver.serving._shared import refusals_raised, stream_of
from naoserver.serving.camera import CameraI
from zenoh_ice import Clock, Current


class ClockI(ClockServant):
    """Report the robot's time, in calls and as a stream."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.publish: Final = stream_of(self._reading, self.getTimePublisher).send
        """Send the time to the listeners."""

    def getTime(self, current: Current) -> ClockReading:
        return self._reading()

    def _reading(self) -> ClockReading:
        return ClockReading(time=self._clock.now(), rate=self._clock.rate, simulated=self._clock.simulated)


class HealthI(Health):
    """Report the health of the robot and its server, in calls and as a stream."""

    def __init__(self, robot: Robot, gate: Gate, cameras: Sequence[CameraI]) -> None:
        self._robot = robot
        self._gate = gate
        self._events = events = gate.events
        self._cameras = cameras
        self._started = events.wall_time()
        self._condition = ConditionWatch(robot, events)
        self._joints = JointWatch(robot, events)
        self.report_now: Final = stream_of(self._report, self.getHealthPublisher).send
        """Send a report at once, for an event that cannot wait for the next one."""

    def getHealth(self, current: Current) -> HealthReport:
        return self._report()

    def publish(self) -> None:
        """Check the robot, and send a report to the listeners."""
        self._condition.poll(self._robot.state())
        self._joints.poll(self._robot.read())
        self.report_now()

    def _report(self) -> HealthReport:
        state = self._robot.state()
        events, limited, timeouts = self._events.snapshot()
        return HealthReport(
            time=self._robot.clock.now(),
            uptime=self._events.wall_time() - self._started,
            realTimeFactor=0.0 if self._gate.is_robot_lost else state.real_time_factor,
            lag=state.lag,
            torsoTilt=state.torso_tilt,
            fallen=state.fallen,
            cameraRates={camera.facts.name: camera.delivered_rate for camera in self._cameras},
            limitedCommands=limited,
            velocityTimeouts=timeouts,
            events=events,
        )


class SafetyI(Safety):
    """Stop the robot for everybody, or hold it for one client."""

    ice_concurrent = True  # a stop waits for no other call
    ice_urgent = True  # and is never refused for lack of a thread
    ice_frozen = frozenset({"emergencyStop"})  # zenoh_ice/application/emergency_stop.py says what is sent

    def __init__(self, gate: Gate, moves_for: Callable[[str], bool]) -> None:
        self._gate = gate
        self._moves_for = moves_for
        self.publish: Final = stream_of(gate.state, self.getSafetyStatePublisher).send
        """Publish the present right to command the robot."""

    def emergencyStop(self, reason: str, current: Current) -> None:
        try:
            self._gate.stop(reason)
        finally:
            self.publish()

    def resetEmergencyStop(self, resume: bool | None, current: Current) -> None:
        self._gate.reset(resume=bool(resume))
        self.publish()

    def resumeCommands(self, current: Current) -> None:
        self._gate.let_go_on(current.client)

    def acquireLease(self, holder: str, seconds: float, current: Current) -> None:
        with refusals_raised():
            self._gate.acquire(current.client, holder, seconds)
        self.publish()

    def releaseLease(self, current: Current) -> None:
        self.drop_client(current.client)

    def getSafetyState(self, current: Current) -> SafetyState:
        return self._gate.state()

    def isMoving(self, current: Current) -> bool:
        return self._moves_for(current.client)

    def drop_client(self, client: str) -> None:
        """Give back the lease of a lost client."""
        if self._gate.release(client):
            self.publish()


class DescriptionI(Description):
    """Report a body, and its looks: `looks` returns them as JSON, or an empty text."""

    def __init__(self, body: Body, looks: Callable[[], str]) -> None:
        self._body = cache(lambda: write_body(body))
        self._looks = cache(looks)

    def getBody(self, current: Current) -> str:
        return self._body()

    def getLooks(self, current: Current) -> str:
        return self._looks()
