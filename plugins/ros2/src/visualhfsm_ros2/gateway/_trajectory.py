"""Joint trajectories, by the action FollowJointTrajectory or a topic, as in ros2_control's controller.

A goal is checked before anything moves. While it runs, each sample of the joints' state leads to the next
targets. It thus follows the robot's time, waits while a simulation is paused, and ends with this process.
Positions are interpolated by cubics if every point has velocities, else linearly.

The topic has neither a result nor feedback. A newer message replaces an older one without a halt between
them, so that a stream of short ones is smooth; an empty one stops the joints, and so does the end of the
publisher.
"""

from __future__ import annotations

import bisect
import logging
import math
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from interfaces.nao import JointLimits, JointsPrx, JointState
from zenoh_ice import Sample, SystemException, TimeoutException, UserException
from zenoh_ros2 import Aborted, Canceled, Sender, ServerGoal, Types

TYPE: Final = "control_msgs/action/FollowJointTrajectory"

SUCCESSFUL: Final = 0
INVALID_GOAL: Final = -1
INVALID_JOINTS: Final = -2
OLD_HEADER_TIMESTAMP: Final = -3
PATH_TOLERANCE_VIOLATED: Final = -4
GOAL_TOLERANCE_VIOLATED: Final = -5

_MOST_POINTS: Final = 10_000
_LONGEST_TRAJECTORY: Final = 3600.0
"""Maximum robot seconds until a trajectory begins, and maximum duration."""
_BEYOND: Final = 0.01
"""Distance in rad by which a position may exceed its joint's limits: planners round."""
_GOAL_LIMIT: Final = 5.0
"""Robot seconds in which the goal is to be reached if the request gives no time."""
_FEEDBACK: Final = 0.1
"""Robot seconds between two feedbacks."""
_SILENCE: Final = 1.0
"""Wall seconds after which a stream without samples is checked: the simulation may be paused."""
_LONGEST_STEP: Final = 0.1
"""Maximum robot seconds by which the setpoints are ahead."""
_HURRY: Final = 1.5
"""Factor by which the setpoints are faster than the trajectory, so that they do not fall behind."""
_SLOWEST_FRACTION: Final = 0.001

Numbers = NDArray[np.float64]


class TrajectoryError(Exception):
    """A trajectory was refused or failed; it has the action's error code and a text for people."""

    def __init__(self, text: str, code: int = INVALID_GOAL) -> None:
        super().__init__(text)
        self.code = code


class SupersededError(TrajectoryError):
    """A newer trajectory took its joints."""


class Order(Protocol):
    """Who wants a trajectory to be followed."""

    @property
    def canceled(self) -> bool:
        """Return whether it is to end, and its joints are to be held."""

    def publish_feedback(self, feedback: object, /) -> None:
        """Report how far it is: the fields of the action's feedback."""


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Positions in rad of some joints at increasing times in s, and tolerances."""

    joints: tuple[str, ...]
    times: tuple[float, ...]
    positions: Numbers
    """Shape (times, joints)."""
    velocities: Numbers | None
    """In rad/s; None where a point has none."""
    start: float | None
    """Time of ROS at which it begins; None for immediately."""
    path_tolerances: Mapping[str, float]
    """In rad, by joint, for those that have one."""
    goal_tolerances: Mapping[str, float]
    settling: float
    """Seconds after its end in which the goal tolerances are to be met."""

    def at(self, time: float) -> Numbers:
        """Return the positions at a time in s since the start; beyond the ends, those at the ends."""
        times, positions = self.times, self.positions
        index = bisect.bisect_right(times, time)
        if index in (0, len(times)):
            return np.asarray(positions[min(index, len(times) - 1)])
        before, after = positions[index - 1], positions[index]
        span = times[index] - times[index - 1]
        share = (time - times[index - 1]) / span
        if self.velocities is None:
            return np.asarray(before + share * (after - before))
        slow, fast = self.velocities[index - 1] * span, self.velocities[index] * span
        bend = 3.0 * (after - before) - 2.0 * slow - fast
        twist = 2.0 * (before - after) + slow + fast
        return np.asarray(before + share * (slow + share * (bend + share * twist)))

    def from_positions(self, positions: Sequence[float]) -> Trajectory:
        """Return the trajectory extended by a way from the joints' present positions to its first point."""
        if self.times[0] <= 0.0:
            return self
        velocities = self.velocities
        if velocities is not None:
            velocities = np.vstack((np.zeros(len(self.joints)), velocities))
        times, rows = (0.0, *self.times), np.vstack((positions, self.positions))
        return replace(self, times=times, positions=rows, velocities=velocities)


def read_goal(goal: Any, limits: Mapping[str, JointLimits]) -> Trajectory:  # noqa: ANN401 - a message's class
    """Return the trajectory of a goal of the action; raises TrajectoryError, which names the joint."""
    request = goal.trajectory
    joints = _joints(request.joint_names, limits)
    if goal.multi_dof_trajectory.points:
        raise TrajectoryError("multi_dof_trajectory: the joints turn about one axis each")
    if not 0 < len(request.points) <= _MOST_POINTS:
        found = f"{len(request.points)} points"
        raise TrajectoryError(f"trajectory.points: {found}; from 1 to {_MOST_POINTS} are taken")
    times = tuple(_seconds(point.time_from_start) for point in request.points)
    for index, (before, after) in enumerate(zip((-1e-9, *times), times, strict=False)):
        if not before < after <= _LONGEST_TRAJECTORY:
            at = f"points[{index}].time_from_start: {after:g} s"
            raise TrajectoryError(f"{at}; times increase, up to {_LONGEST_TRAJECTORY:g} s")
    positions = _rows(request.points, "positions", joints)
    some = [index for index, point in enumerate(request.points) if len(point.velocities)]
    velocities = _rows(request.points, "velocities", joints) if len(some) == len(times) else None
    for column, joint in enumerate(joints):
        lower, upper = limits[joint].lower, limits[joint].upper
        worst = positions[:, column]
        outside = np.flatnonzero((worst < lower - _BEYOND) | (worst > upper + _BEYOND))
        if outside.size:
            index = int(outside[0])
            at = f"points[{index}].positions: {joint} at {worst[index]:.4g} rad"
            raise TrajectoryError(f"{at}; {lower:.4g} to {upper:.4g}")
    start = _seconds(request.header.stamp)
    wait = _seconds(goal.goal_time_tolerance)
    return Trajectory(
        joints,
        times,
        positions,
        velocities,
        start if start > 0.0 else None,
        _tolerances("path_tolerance", goal.path_tolerance, joints),
        _tolerances("goal_tolerance", goal.goal_tolerance, joints),
        min(wait, _LONGEST_TRAJECTORY) if wait > 0.0 else _GOAL_LIMIT,
    )


def _joints(names: Sequence[str], limits: Mapping[str, JointLimits]) -> tuple[str, ...]:
    problem = ""
    if not names:
        problem = "trajectory.joint_names: there are none"
    elif len(names) > len(limits):
        problem = f"trajectory.joint_names: {len(names)}; there are {len(limits)} joints"
    elif unknown := [name for name in names if name not in limits]:
        problem = f"there is no joint {unknown[0][:64]!r}; there are {', '.join(limits)}"
    elif passive := [name for name in names if not limits[name].maxTorque]:
        problem = f"{passive[0]} has no motor: it moves with what touches it"
    elif twice := [name for name in names if list(names).count(name) > 1]:
        problem = f"trajectory.joint_names: {twice[0]} stands there twice"
    if problem:
        raise TrajectoryError(problem, INVALID_JOINTS)
    return tuple(names)


def _rows(points: Sequence[Any], field: str, joints: Sequence[str]) -> Numbers:
    for index, point in enumerate(points):
        row = getattr(point, field)
        if len(row) != len(joints):
            raise TrajectoryError(f"points[{index}].{field}: {len(row)} numbers for {len(joints)} joints")
        if not np.isfinite(row).all():
            joint = joints[int(np.flatnonzero(~np.isfinite(row))[0])]
            raise TrajectoryError(f"points[{index}].{field}: {joint} is not a finite number")
    return np.array([getattr(point, field) for point in points], np.float64)


def _tolerances(field: str, given: Sequence[Any], joints: Sequence[str]) -> dict[str, float]:
    """Return the effective tolerances in rad: 0 is the default, no limit; a negative one lifts the limit."""
    for tolerance in given:
        if tolerance.name not in joints:
            raise TrajectoryError(f"{field}: the trajectory has no joint {tolerance.name[:64]!r}")
        if not math.isfinite(tolerance.position):
            raise TrajectoryError(f"{field}: {tolerance.name} is not a finite number")
    return {tolerance.name: tolerance.position for tolerance in given if tolerance.position > 0.0}


def _seconds(moment: Any) -> float:  # noqa: ANN401 - a Time or a Duration
    return float(moment.sec + moment.nanosec / 1e9)


class TrajectoryFollower:
    """Execute trajectories on the joints of `body`; a newer one takes over joints from an older one."""

    def __init__(
        self, body: JointsPrx, robot_time: Callable[[float], float], stops: Callable[[], object]
    ) -> None:
        """Follow trajectories; `robot_time` converts a time of ROS in s to the robot's.

        `stops` returns another value after each emergency stop.
        """
        self._body = body
        self._stops: Final = stops
        self._robot_time: Final = robot_time
        self._names: Final = tuple(body.getJointNames())
        self.limits: Final = {limits.name: limits for limits in body.getJointLimits()}
        """Those of each joint by name."""
        self._lock = threading.Lock()
        self._owners: dict[str, Order] = {}

    def execute(self, goal: ServerGoal) -> dict[str, object]:
        """Follow the trajectory of a goal to its end; the action's `execute`."""
        try:
            trajectory = read_goal(goal.request, self.limits)
            self.claim(goal, trajectory)
            try:
                self.follow(goal, trajectory)
            finally:
                self.release(goal)
        except (TrajectoryError, UserException, SystemException) as error:  # refused, or the server is gone
            code = error.code if isinstance(error, TrajectoryError) else INVALID_GOAL
            raise Aborted(str(error), {"error_code": code, "error_string": str(error)}) from error
        return {"error_code": SUCCESSFUL, "error_string": ""}

    def claim(self, order: Order, trajectory: Trajectory, former: Collection[Order | None] = ()) -> None:
        """Give an order the joints of its trajectory, and all joints of `former` orders: these end."""
        with self._lock:
            taken = [name for name, owner in self._owners.items() if owner in former]
            self._owners |= dict.fromkeys([*taken, *trajectory.joints], order)

    def release(self, order: Order) -> None:
        """Take back the joints of an order."""
        with self._lock:
            self._owners = {name: owner for name, owner in self._owners.items() if owner is not order}

    def follow(self, order: Order, trajectory: Trajectory) -> None:
        """Follow a trajectory whose joints were claimed to its end.

        Raises Canceled once the joints of a cancelled one are held, SupersededError when another order has
        claimed some of them, TrajectoryError when it fails, and what a call of the robot raises.
        """
        columns = [self._names.index(name) for name in trajectory.joints]
        sample = self._body.getJointState.wait()
        start = sample.time if trajectory.start is None else self._robot_time(trajectory.start)
        if start + trajectory.times[-1] < sample.time:
            late = sample.time - start
            ended = f"it was to begin {late:.3g} s ago, and has ended since"
            raise TrajectoryError(ended, OLD_HEADER_TIMESTAMP)
        if start > sample.time + _LONGEST_TRAJECTORY:
            wait = f"it is to begin in {start - sample.time:.4g} s"
            raise TrajectoryError(f"{wait}; at most {_LONGEST_TRAJECTORY:g}")
        waits = start > sample.time
        stops = self._stops() if waits else None
        if waits:
            self._body.setJointPositions({}, 1.0)  # refused now, not when it begins
        trajectory = trajectory.from_positions([sample.value.commands[column] for column in columns])
        fed, moved = -math.inf, False
        while True:
            before, sample = sample, self._next(order, sample)
            state = sample.value
            time = sample.time - start
            period = sample.time - before.time
            if period < 0.0:
                raise TrajectoryError("the simulation began again")
            # One that is replaced at once still has its turn: a stream of them must not stand still.
            canceled = order.canceled
            if (moved or canceled or time < 0.0) and self._has_lost(order, trajectory):
                raise SupersededError("a newer trajectory took its joints")
            if canceled:
                self._hold(trajectory, state, columns)
                raise Canceled({"error_code": SUCCESSFUL, "error_string": "canceled"})
            if time < 0.0:
                continue
            if waits and self._stops() != stops:
                raise TrajectoryError("the robot was stopped before it began")
            waits = False
            self._steer(trajectory, time, min(period, _LONGEST_STEP), state, columns)
            moved = True
            desired, actual = trajectory.at(time), np.array([state.positions[column] for column in columns])
            if time - fed >= _FEEDBACK:
                fed = time
                order.publish_feedback(_feedback(trajectory.joints, desired, actual, time))
            over = time - trajectory.times[-1]
            strayed = _worst(trajectory, desired, actual, trajectory.path_tolerances if over <= 0.0 else {})
            missed = _worst(trajectory, desired, actual, trajectory.goal_tolerances) if over >= 0.0 else ""
            if over >= 0.0 and not missed:
                return
            if strayed or over > trajectory.settling:
                self._hold(trajectory, state, columns)
                code = PATH_TOLERANCE_VIOLATED if strayed else GOAL_TOLERANCE_VIOLATED
                raise TrajectoryError(strayed or missed, code)

    def _has_lost(self, order: Order, trajectory: Trajectory) -> bool:
        with self._lock:
            return any(self._owners.get(name) is not order for name in trajectory.joints)

    def _next(self, order: Order, sample: Sample[JointState]) -> Sample[JointState]:
        """Return the next sample, or the same one if the order is cancelled before the next arrives."""
        while not order.canceled:
            try:
                return self._body.getJointState.wait(after=sample, timeout=_SILENCE)
            except TimeoutException:
                continue  # paused; a lost server raises another exception
        return sample

    def _steer(
        self, trajectory: Trajectory, time: float, period: float, state: JointState, columns: Sequence[int]
    ) -> None:
        """Send the setpoints to their targets at the next sample, no faster than necessary."""
        targets = trajectory.at(time + period)
        commands = np.array([state.commands[column] for column in columns])
        highest = np.array([self.limits[name].maxVelocity for name in trajectory.joints])
        needed = float(np.max(np.abs(targets - commands) / highest)) / max(period, 0.001)
        fraction = min(max(_HURRY * needed, _SLOWEST_FRACTION), 1.0)
        self._body.setJointPositions(dict(zip(trajectory.joints, targets.tolist(), strict=True)), fraction)

    def _hold(self, trajectory: Trajectory, state: JointState, columns: Sequence[int]) -> None:
        positions = [state.positions[column] for column in columns]
        self._body.setJointPositions(dict(zip(trajectory.joints, positions, strict=True)), 1.0)


def _worst(trajectory: Trajectory, desired: Numbers, actual: Numbers, tolerances: Mapping[str, float]) -> str:
    """Return the joint that is too far from its desired position; empty when none is."""
    for joint, wanted, found in zip(trajectory.joints, desired, actual, strict=True):
        if abs(found - wanted) > tolerances.get(joint, math.inf):
            most = tolerances[joint]
            return f"{joint} is at {found:.4g} rad instead of {wanted:.4g}; it may differ by {most:.4g}"
    return ""


def _feedback(joints: Sequence[str], desired: Numbers, actual: Numbers, time: float) -> dict[str, object]:
    whole = {"sec": int(time), "nanosec": int(time % 1.0 * 1e9)}
    points = {"desired": desired, "actual": actual, "error": desired - actual}
    named = {name: {"positions": values, "time_from_start": whole} for name, values in points.items()}
    return {"joint_names": list(joints), **named}


MESSAGE: Final = "trajectory_msgs/msg/JointTrajectory"
_CLOSE_LIMIT: Final = 2.0  # s

_logger = logging.getLogger(__name__)


class TrajectoryTopic:
    """Follows the newest trajectory of a topic on a thread, which runs while there is one."""

    def __init__(self, types: Types, follower: TrajectoryFollower, refuse: Callable[[str], object]) -> None:
        """Take trajectories; `refuse` gets why one was refused or ended early."""
        self._types: Final = types
        self._follower: Final = follower
        self._refuse: Final = refuse
        self._lock: Final = threading.Lock()
        self._current: _Order | None = None
        self._next: tuple[_Order, Trajectory] | None = None
        self._thread: threading.Thread | None = None
        self._closed = False

    def receive(self, message: Any, sender: Sender) -> None:  # noqa: ANN401 - a message's class
        """Follow a message's trajectory from now on; raises TrajectoryError for one that makes no sense."""
        if not message.points:
            self._stop()
            return
        goal = self._types.make(f"{TYPE}_Goal", trajectory=message)
        trajectory = read_goal(goal, self._follower.limits)
        order = _Order(sender)
        with self._lock:
            if self._closed:
                return
            former = self._current, self._next[0] if self._next else None
            self._follower.claim(order, trajectory, former)
            self._next = order, trajectory
            if self._thread is None:
                thread = threading.Thread(target=self._run, name="trajectories of a topic", daemon=True)
                thread.start()
                self._thread = thread  # not earlier: without a thread the next message tries again

    def close(self) -> None:
        """Stop the joints that it moves."""
        with self._lock:
            self._closed = True
            thread = self._thread
        self._stop()
        if thread is not None:
            thread.join(_CLOSE_LIMIT)

    def _stop(self) -> None:
        with self._lock:
            self._next = None
            if self._current is not None:
                self._current.stopped = True

    def _run(self) -> None:
        while True:
            with self._lock:
                if self._next is None:
                    self._current = self._thread = None
                    return
                (order, trajectory), self._next = self._next, None
                self._current = order
            try:
                self._follower.follow(order, trajectory)
            except Canceled:
                if order.sender.gone:
                    self._refuse("its publisher is gone: its joints are held")
            except SupersededError as error:
                _logger.debug("a trajectory of a topic: %s", error)
            except (TrajectoryError, UserException, SystemException) as error:
                self._refuse(str(error))
            except BaseException:  # nothing may end the thread: it follows the next one, too
                _logger.exception("a trajectory of a topic failed")
            finally:
                self._follower.release(order)


class _Order:
    """A trajectory that is followed without a client that waits."""

    def __init__(self, sender: Sender) -> None:
        self.sender: Final = sender
        self.stopped = False

    @property
    def canceled(self) -> bool:
        """Return whether its joints are to be held."""
        return self.stopped or self.sender.gone

    def publish_feedback(self, feedback: object) -> None:
        """Report to nobody."""
