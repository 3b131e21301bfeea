"""Carry a ball of the simulated world along a route with setpoints, and wait at each stop for it."""

from __future__ import annotations

import logging
import math
import threading
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

from ._axes import AxisLimits, AxisPosition
from ._exceptions import NotArrivedException
from ._progress import Progress
from ._route import Approach, Line, Move, Route, Stop
from ._waypoints import Color

PERIOD: Final = 0.02
"""Time between setpoints in s of the component's clock, unless that runs much faster than the wall's."""

_LEAST_WALL_PERIOD: Final = 0.005  # s of wall time between setpoints, however fast a simulation runs
_STILL: Final = 0.0005  # m between two setpoints
_RETRY_PERIOD: Final = 0.2  # s of wall time between checks whether a lost server is back
_LOST: Final = (ConnectionLostException, ObjectNotExistException, TimeoutException)

_CALL_LIMIT: Final = 800  # ms; a server that hangs is reported within a second

_logger = logging.getLogger(__name__)


class Ball:
    """Command the axes of a ball and read their positions.

    Every method calls the server and raises the exceptions of zenoh_ice.
    """

    def __init__(self, motors: Pose3DMotorsPrx, encoders: Pose3DEncodersPrx) -> None:
        self._motors = motors
        self._encoders = encoders
        self.limits = AxisLimits.from_params(motors.getPose3DMotorsParams())

    @classmethod
    def connect(cls, communicator: Communicator, color: Color) -> Ball:
        """Return the ball of a color; for green, the identities are BallGreenMotors and BallGreenEncoders."""
        identity = f"Ball{color.capitalize()}"
        motors = Pose3DMotorsPrx.checkedCast(communicator.stringToProxy(f"{identity}Motors"))
        encoders = Pose3DEncodersPrx.checkedCast(communicator.stringToProxy(f"{identity}Encoders"))
        limit = min(_CALL_LIMIT, round(communicator.settings.timeout * 1000))
        return cls(motors.ice_invocationTimeout(limit), encoders.ice_invocationTimeout(limit))

    def command(self, target: AxisPosition) -> None:
        """Send the axes to a position as fast as they can: the steps between setpoints are small."""
        self._motors.setPose3DMotorsData(
            Pose3DMotorsData(
                x=target.distance,
                y=0.0,
                z=target.height,
                pan=target.pan,
                tilt=0.0,
                roll=0.0,
                panSpeed=self.limits.max_pan_speed,
                tiltSpeed=self.limits.max_linear_speed,
            )
        )

    def position(self) -> AxisPosition:
        """Return the present position of the axes."""
        data = self._encoders.getPose3DEncodersData()
        return AxisPosition(pan=data.pan, distance=data.x, height=data.z)


class _TimeRestartedError(Exception):
    """The simulation restarted, so the ball has moved."""


class _StopRequestedError(Exception):
    """The run is to end."""


class Mover:
    """Carry a ball along a route, until `ending` is set.

    Times are those of `clock`. `tolerance` is the greatest distance in m between the ball, by its encoders,
    and a waypoint at which it counts as arrived; `limit` is the time in s within which it has to arrive after
    the last setpoint is sent.
    """

    def __init__(
        self,
        ball: Ball,
        clock: Clock,
        route: Route,
        progress: Progress,
        *,
        ending: threading.Event,
        tolerance: float = 0.02,
        limit: float = 5.0,
    ) -> None:
        self._ball = ball
        self._clock = clock
        self._route = route
        self._progress = progress
        self._tolerance = tolerance
        self._limit = limit
        self._index = 0
        self._lap = 1
        self._away = False
        self._last_tick = clock.now()
        self._ending = ending

    def run(self, *, loop: bool) -> None:
        """Carry the ball to the last stop or, with `loop`, round and round, until `ending` is set.

        If the server goes offline, wait for it; then move on to the same stop.
        The ball is stopped, however the run ends. Raises NotArrivedException, and the exceptions of the
        servants.
        """
        try:
            while True:
                try:
                    self._travel(loop=loop)
                except _LOST as error:
                    self._wait_for_return(error)
                except _TimeRestartedError:
                    _logger.info("the simulation restarted; continuing with waypoint %d", self._index + 1)
                else:
                    return
        except _StopRequestedError:
            self._stop()
        except BaseException:
            self._stop()
            raise

    def _travel(self, *, loop: bool) -> None:
        """Move from the present position to the next stop, then along the route."""
        self._last_tick = self._clock.now()
        stops = self._route.stops
        move: Move = Approach(self._ball.position(), stops[self._index].axes, self._route.limits)
        while True:
            stop = stops[self._index]
            self._progress.departed(self._index, stop, self._lap)
            self._follow(move, stop)
            self._settle(stop)
            self._hold(stop, stop.waypoint.dwell)
            if self._index + 1 == len(stops):
                if not loop:
                    self._rest(stop)
                    return
                if len(stops) == 1:
                    self._hold(stop, math.inf)
            self._index += 1
            if self._index == len(stops):
                self._index = 0
                self._lap += 1
            move = Line(stop.axes, stops[self._index].waypoint.point)

    def _follow(self, move: Move, stop: Stop) -> None:
        """Send the setpoints of a movement."""
        start = self._clock.now()
        duration = move.duration(stop.speed)
        fraction = 0.0
        while fraction < 1.0:
            self._tick()
            elapsed = self._clock.now() - start
            fraction = min(1.0, elapsed / duration) if duration > 0.0 else 1.0
            target = move.at(fraction)
            self._ball.command(target)
            self._progress.moved(target.point, fraction)

    def _settle(self, stop: Stop) -> None:
        """Hold the stop's setpoint until the ball has arrived, according to the encoders."""
        deadline = self._clock.now() + self._limit
        while True:
            error = self._ball.position().point.distance_to(stop.waypoint.point)
            if error <= self._tolerance:
                self._progress.arrived(stop, error)
                return
            if self._clock.now() >= deadline:
                raise NotArrivedException(
                    f"{stop.waypoint}: after {self._limit:g} s the ball is still {error:.3f} m away, more "
                    f"than the tolerance of {self._tolerance:g} m; is it blocked, or does somebody else "
                    "move it?"
                )
            self._tick()
            self._ball.command(stop.axes)

    def _hold(self, stop: Stop, seconds: float) -> None:
        """Stay at a stop; keep sending commands, to notice a lost server."""
        end = self._clock.now() + seconds
        while self._clock.now() < end:
            self._tick()
            self._ball.command(stop.axes)

    def _rest(self, stop: Stop) -> None:
        """Hold the last stop's setpoint until the ball is still: robots stop what a former client moves."""
        deadline = self._clock.now() + self._limit
        before, place = None, self._ball.position().point
        while (before is None or place.distance_to(before) > _STILL) and self._clock.now() < deadline:
            self._tick()
            self._ball.command(stop.axes)
            before, place = place, self._ball.position().point

    def _tick(self) -> None:
        """Wait until the next setpoint is due; an overdue one is sent at once, missed ones are skipped."""
        period = max(PERIOD, _LEAST_WALL_PERIOD * self._clock.rate)
        due = self._last_tick + period
        if self._clock.wait(self._ending, due - self._clock.now()):
            raise _StopRequestedError
        now = self._clock.now()
        if now < self._last_tick:
            raise _TimeRestartedError
        self._last_tick = due if now < due + period else now

    def _wait_for_return(self, error: ZenohIceError) -> None:
        self._away = True
        self._progress.lost(str(error))
        while True:
            if self._ending.wait(_RETRY_PERIOD):
                raise _StopRequestedError
            try:
                self._ball.position()
            except _LOST:
                continue
            self._away = False
            self._progress.returned()
            return

    def _stop(self) -> None:
        if self._away:
            return
        try:
            self._ball.command(self._ball.position())
        except ZenohIceError as error:
            _logger.warning("cannot stop the ball: %s", error)
