"""Carry a ball of the simulated world along waypoints with setpoints, and wait at each one for it."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from interfaces.jderobot import Pose3DEncodersPrx, Pose3DMotorsData, Pose3DMotorsPrx
from zenoh_ice import Communicator
from zenoh_ice.data.exceptions import (
    ConnectionLostException,
    ObjectNotExistException,
    TimeoutException,
    ZenohIceError,
)
from zenoh_ice.threads.clock import Clock

from ._exceptions import NotArrivedException
from ._waypoints import Color, Point, Waypoint

PERIOD: Final = 0.02
"""Time between setpoints in s of the component's clock, unless that runs much faster than the wall's."""

_LEAST_WALL_PERIOD: Final = 0.005  # s of wall time between setpoints, however fast a simulation runs
_STILL: Final = 0.0005  # m between two setpoints
_RETRY_PERIOD: Final = 0.2  # s of wall time between checks whether a lost server is back
_LOST: Final = (ConnectionLostException, ObjectNotExistException, TimeoutException)

_CALL_LIMIT: Final = 800  # ms; a server that hangs is reported within a second

_logger = logging.getLogger(__name__)


class Ball:
    """Command a ball to points and read where it is.

    It hangs on three axes: pan in rad round the vertical at the origin of the world (0 straight ahead of the
    robot, positive to its left), distance from that, and height. The server limits what they cannot do;
    every method calls it and raises the exceptions of zenoh_ice.
    """

    def __init__(self, communicator: Communicator, color: Color) -> None:
        limit = min(_CALL_LIMIT, round(communicator.settings.timeout * 1000))
        name = f"Ball{color.capitalize()}"
        motors = Pose3DMotorsPrx.checkedCast(communicator.stringToProxy(f"{name}Motors"))
        encoders = Pose3DEncodersPrx.checkedCast(communicator.stringToProxy(f"{name}Encoders"))
        self.color = color
        self._motors = motors.ice_invocationTimeout(limit)
        self._encoders = encoders.ice_invocationTimeout(limit)
        params = motors.getPose3DMotorsParams()
        self._fastest = {"panSpeed": params.maxPanSpeed, "tiltSpeed": params.maxTiltSpeed}

    def command(self, target: Point) -> None:
        """Send the ball to a point as fast as it can go: the steps between setpoints are small."""
        pan, distance = math.atan2(target.y, target.x), math.hypot(target.x, target.y)
        self._motors.setPose3DMotorsData(
            Pose3DMotorsData(x=distance, y=0.0, z=target.z, pan=pan, tilt=0.0, roll=0.0, **self._fastest)
        )

    def position(self) -> Point:
        """Return where the ball is."""
        data = self._encoders.getPose3DEncodersData()
        return Point(data.x * math.cos(data.pan), data.x * math.sin(data.pan), data.z)


class _TimeRestartedError(Exception):
    """The simulation restarted, so the ball has moved."""


class _StopRequestedError(Exception):
    """The run is to end."""


@dataclass
class Mover:
    """Carry a ball along waypoints, until `ending` is set.

    Times are those of `clock`. `speed` in m/s is that of waypoints without their own. `tolerance` is the
    greatest distance in m between the ball, by its encoders, and a waypoint at which it counts as arrived;
    `limit` is the time in s within which it has to arrive after the last setpoint is sent.
    """

    ball: Ball
    clock: Clock
    waypoints: Sequence[Waypoint]
    ending: threading.Event
    speed: float = 0.25
    tolerance: float = 0.02
    limit: float = 5.0
    _index: int = 0
    _last_tick: float = 0.0

    def run(self, *, loop: bool) -> None:
        """Carry the ball to the last waypoint or, with `loop`, round and round, until `ending` is set.

        If the server goes offline, wait for it; then move on to the same waypoint.
        The ball is stopped, however the run ends. Raises NotArrivedException, and the exceptions of the
        servants.
        """
        try:
            while True:
                try:
                    self._travel(loop=loop)
                    return
                except _LOST as error:
                    if not self._is_back(error):
                        return
                except _TimeRestartedError:
                    _logger.info("the simulation restarted; continuing with %s", self._goal)
        except BaseException as error:
            try:
                self.ball.command(self.ball.position())
            except ZenohIceError as problem:
                _logger.warning("cannot stop the ball: %s", problem)
            if not isinstance(error, _StopRequestedError):
                raise

    @property
    def _goal(self) -> str:
        return f"waypoint {self._index + 1} of {len(self.waypoints)} {self.waypoints[self._index].point}"

    def _travel(self, *, loop: bool) -> None:
        """Move from the present position to the next waypoint, then along the others."""
        self._last_tick = self.clock.now()
        start = self.ball.position()
        while True:
            goal = self.waypoints[self._index]
            self._follow(start, goal.point, goal.speed or self.speed)
            self._settle(goal.point)
            self._hold(goal.point, goal.dwell)
            if self._index + 1 == len(self.waypoints):
                if not loop:
                    self._rest(goal.point)
                    return
                if self._index == 0:
                    self._hold(goal.point, math.inf)
            self._index = (self._index + 1) % len(self.waypoints)
            start = goal.point

    def _follow(self, start: Point, goal: Point, speed: float) -> None:
        """Send the setpoints of a straight line at constant speed."""
        _logger.debug("%s: %s at %.3g m/s", self.ball.color, self._goal, speed)
        began = self.clock.now()
        duration = math.dist(start, goal) / speed
        while (elapsed := self._tick() - began) < duration:
            there = elapsed / duration
            self.ball.command(Point(*(a + there * (b - a) for a, b in zip(start, goal, strict=True))))
        self.ball.command(goal)

    def _settle(self, goal: Point) -> None:
        """Hold the waypoint's setpoint until the ball has arrived, according to the encoders."""
        deadline = self.clock.now() + self.limit
        while (error := math.dist(self.ball.position(), goal)) > self.tolerance:
            if self.clock.now() >= deadline:
                raise NotArrivedException(
                    f"{self._goal}: after {self.limit:g} s the ball is still {error:.3f} m away, more than "
                    f"the tolerance of {self.tolerance:g} m; is it out of reach or blocked, or does somebody "
                    "else move it?"
                )
            self._send(goal)
        _logger.debug("%s: arrived, %.1f cm off", self.ball.color, error * 100)

    def _hold(self, place: Point, seconds: float) -> None:
        """Stay at a waypoint; keep sending commands, to notice a lost server."""
        end = self.clock.now() + seconds
        while self.clock.now() < end:
            self._send(place)

    def _rest(self, goal: Point) -> None:
        """Hold the last setpoint until the ball is still: robots stop what a former client moves."""
        deadline = self.clock.now() + self.limit
        before, place = None, self.ball.position()
        while (before is None or math.dist(place, before) > _STILL) and self.clock.now() < deadline:
            self._send(goal)
            before, place = place, self.ball.position()

    def _send(self, place: Point) -> None:
        self._tick()
        self.ball.command(place)

    def _tick(self) -> float:
        """Wait until the next setpoint is due and return the time; missed ones are skipped."""
        period = max(PERIOD, _LEAST_WALL_PERIOD * self.clock.rate)
        due = self._last_tick + period
        if self.clock.wait(self.ending, due - self.clock.now()):
            raise _StopRequestedError
        now = self.clock.now()
        if now < self._last_tick:
            raise _TimeRestartedError
        self._last_tick = due if now < due + period else now
        return now

    def _is_back(self, error: ZenohIceError) -> bool:
        """Wait until the ball answers again; return False if the run is to end before."""
        _logger.warning("%s: lost the ball; waiting for its server: %s", self.ball.color, error)
        while not self.ending.wait(_RETRY_PERIOD):
            with suppress(*_LOST):
                self.ball.position()
                _logger.warning("%s: the ball is back; continuing", self.ball.color)
                return True
        return False
