"""Servants of the robot's clock and of the server's health."""

from __future__ import annotations

from collections.abc import Sequence

from interfaces.nao import Clock as ClockServant
from interfaces.nao import ClockReading, Health, HealthReport
from naoserver.event_log import ConditionWatch, EventLog
from naoserver.robot import Robot
from naoserver.servants.camera import CameraI
from zenoh_ice import Clock, Current


class ClockI(ClockServant):
    """Report the robot's time, in calls and as a stream."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def getTime(self, current: Current) -> ClockReading:
        """Return the robot's time."""
        return self._reading()

    def publish(self) -> None:
        """Send the time to the listeners."""
        if self.getTimePublisher.listening:
            reading = self._reading()
            self.getTimePublisher.publish(reading, time=reading.time)

    def _reading(self) -> ClockReading:
        return ClockReading(time=self._clock.now(), rate=self._clock.rate, simulated=self._clock.simulated)


class HealthI(Health):
    """Report how the robot and its server are, in calls and as a stream."""

    def __init__(self, robot: Robot, events: EventLog, cameras: Sequence[CameraI]) -> None:
        self._robot = robot
        self._events = events
        self._cameras = cameras
        self._started = events.wall_time()
        self._condition = ConditionWatch(robot, events)

    def getHealth(self, current: Current) -> HealthReport:
        """Return the state of the server."""
        return self._report()

    def publish(self) -> None:
        """Check the robot, and send a report to the listeners."""
        self._condition.look(self._robot.state())
        self.report_now()

    def report_now(self) -> None:
        """Send a report at once: something happened that cannot wait for the next one."""
        if self.getHealthPublisher.listening:
            report = self._report()
            self.getHealthPublisher.publish(report, time=report.time)

    def _report(self) -> HealthReport:
        state = self._robot.state()
        events, limited, timeouts = self._events.snapshot()
        return HealthReport(
            time=self._robot.clock.now(),
            uptime=self._events.wall_time() - self._started,
            realTimeFactor=state.real_time_factor,
            lag=state.lag,
            torsoTilt=state.torso_tilt,
            fallen=state.fallen,
            cameraRates={camera.facts.name: camera.delivered_rate for camera in self._cameras},
            limitedCommands=limited,
            velocityTimeouts=timeouts,
            events=events,
        )
