"""Angles over time, for NAOqi's interpolations, and the tasks that move joints along them.

A robot with a control loop is moved by it; any other one by the thread of the call.
"""

from __future__ import annotations

import threading
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count, pairwise
from typing import Final

from naoserver.errors import InvalidCommand
from naoserver.jobs import ControlLoop, Periodic
from naoserver.qi._access import PERIOD, Access
from naoserver.qi._clients import Call

_BISECTIONS: Final = 30
_EXACT: Final = 1e-12  # s
_SETTLING_LIMIT: Final = 3.0
"""Robot seconds for joints to arrive after the end of a trajectory that was too fast for them."""
_REACHED: Final = 1e-6  # rad
_RESOLUTION: Final = 1e-6
"""Seconds by which the end of a trajectory may be early."""
_CHECK_PERIOD: Final = 0.1
"""Wall seconds between two checks whether a waiting call was cancelled."""


def check_times(joint: str, times: Sequence[float], keys: int) -> None:
    """Raise InvalidCommand unless there are `keys` times, above 0 and increasing."""
    if len(times) != keys or not times:
        raise InvalidCommand(joint, f"{joint}: there are {len(times)} times for {keys} keys")
    if times[0] <= 0.0 or any(later <= time for time, later in pairwise(times)):
        raise InvalidCommand(joint, f"{joint}: the times must be above 0 and increase, not {list(times)}")


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a curve, and its handles: each a time in s and an angle in rad relative to the key."""

    time: float
    angle: float
    before: tuple[float, float] = (0.0, 0.0)
    after: tuple[float, float] = (0.0, 0.0)


class Trajectory:
    """An angle in rad for each time in s: cubic Bezier curves from key to key, as Choregraphe draws them."""

    def __init__(self, joint: str, start: Key, keys: Sequence[Key]) -> None:
        """Begin at `start`, at time 0. Raises InvalidCommand unless the times of the keys increase."""
        check_times(joint, [key.time for key in keys], len(keys))
        self._keys = (start, *keys)
        self._times = [key.time for key in self._keys]
        self.duration: Final = self._times[-1]
        """When the last key is reached in s."""

    def at(self, time: float) -> float:
        """Return the angle at a time; before the start the first angle, after the end the last."""
        if time <= 0.0:
            return self._keys[0].angle
        if time >= self.duration:
            return self._keys[-1].angle
        i = bisect_right(self._times, time) - 1
        begin, end = self._keys[i], self._keys[i + 1]
        span, time = end.time - begin.time, time - begin.time
        # Handles end within the piece, so that the time along the curve never runs backwards.
        handles = min(max(begin.after[0], 0.0), span), span + max(min(end.before[0], 0.0), -span)
        times = (0.0, *handles, span)
        low = 0.0
        high = 1.0
        s = time / span  # with handles of a third of the span, the first guess is exact
        for _ in range(_BISECTIONS):
            late = _bernstein(times, s) - time
            if abs(late) < _EXACT:
                break
            low, high = (s, high) if late < 0.0 else (low, s)
            s = (low + high) / 2
        return _bernstein(
            (begin.angle, begin.angle + begin.after[1], end.angle + end.before[1], end.angle), s
        )


def smooth_trajectory(
    joint: str, start: float, times: Sequence[float], angles: Sequence[float]
) -> Trajectory:
    """Return the trajectory through keys, at rest at both ends, that never overshoots a key.

    The slope at an inner key is the harmonic mean of the slopes on both sides, 0 where the angle turns back:
    Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984). Raises InvalidCommand unless the times increase,
    one for each angle.
    """
    check_times(joint, times, len(angles))
    points = list(pairwise(zip((0.0, *times), (start, *angles), strict=True)))
    spans = [later - time for (time, _), (later, _) in points]
    rises = [(after - before) / span for ((_, before), (_, after)), span in zip(points, spans, strict=True)]
    inner = [
        2.0 * before * after / (before + after) if before * after > 0.0 else 0.0
        for before, after in pairwise(rises)
    ]
    keys = [
        Key(time, angle, (-before / 3, -slope * before / 3), (after / 3, slope * after / 3))
        for time, angle, slope, before, after in zip(
            times, angles, (*inner, 0.0), spans, (*spans[1:], 0.0), strict=True
        )
    ]
    return Trajectory(joint, Key(0.0, start, after=(spans[0] / 3, 0.0)), keys)


def _bernstein(values: tuple[float, float, float, float], s: float) -> float:
    begin, after, before, end = values
    r = 1.0 - s
    return r * r * r * begin + 3.0 * r * s * (r * after + s * before) + s * s * s * end


@dataclass(frozen=True, slots=True)
class Task:
    """A call that moves joints."""

    number: int
    name: str
    joints: frozenset[str]
    call: Call


class JointTasks:
    """Move the joints of a body. If two tasks need the same joint, the later one waits for the earlier."""

    def __init__(self, access: Access) -> None:
        self._access = access
        self._body = access.body
        self._clock = access.robot.clock
        self._loop = access.robot.control_loop
        self._changed = threading.Condition()
        self._tasks: list[Task] = []
        self._taken: dict[str, int] = {}  # the task that moves each joint
        self._numbers = count(1)

    def all(self) -> list[Task]:
        """Return the tasks that move joints or wait for them."""
        with self._changed:
            return list(self._tasks)

    def take(self, joints: Iterable[str]) -> None:
        """Remove joints from the tasks that move them, which continue with the others."""
        with self._changed:
            for joint in joints:
                self._taken.pop(joint, None)

    @contextmanager
    def task(self, name: str, joints: Iterable[str], call: Call) -> Iterator[Task]:
        """Move joints in a `with` block, which begins when no other task moves them."""
        with self._changed:
            task = Task(next(self._numbers), name, frozenset(joints), call)
            self._tasks.append(task)
            while not call.stopped.is_set() and not self._taken.keys().isdisjoint(task.joints):
                self._changed.wait(_CHECK_PERIOD)
            if not call.stopped.is_set():  # a cancelled call takes no joints
                self._taken.update(dict.fromkeys(task.joints, task.number))
        try:
            yield task
        finally:
            with self._changed:
                self._tasks.remove(task)
                for joint in self._own(task, task.joints):
                    del self._taken[joint]
                self._changed.notify_all()

    def follow(self, task: Task, trajectories: Mapping[str, Trajectory]) -> None:
        """Follow trajectories from now on, to their ends; returns earlier when the call is cancelled.

        Raises InvalidCommand and CommandRefused as `GuardedDevice.move` does.
        """
        self._body.gate.require("")  # even when nothing is left to move
        begin, end = self._clock.now(), max(each.duration for each in trajectories.values())
        sent = done = 0.0  # times of the newest setpoints, and at which those of the end were sent

        def step() -> bool:
            """Send the setpoints to where they are to be now; return whether the task continues."""
            nonlocal sent, done
            if task.call.stopped.is_set():
                return False
            time = self._clock.now() - begin
            if time < end - _RESOLUTION or sent < end:  # those of the end, however late the thread is
                sent, done = min(time + PERIOD, end), time
                with self._access.calls.beginning(task.call) as may:  # no step follows a stop
                    if may:
                        self._step(task, trajectories, sent)
                return True
            # Wait until the setpoints have arrived; full speed where they are late.
            late = (self._late(joint, trajectories[joint].at(end)) for joint in self._own(task, trajectories))
            return time < max(end, done) + _SETTLING_LIMIT and any(late)

        if self._loop is None:
            while step() and not task.call.wait(PERIOD):
                pass
        else:
            self._take_steps(self._loop, task, step)
        if task.call.stopped.is_set():
            self._body.gate.require("")  # an emergency stop is reported

    def _take_steps(self, loop: ControlLoop, task: Task, step: Callable[[], bool]) -> None:
        """Take a step every PERIOD in a control loop, until one returns False, or the call is cancelled."""
        ended, errors = threading.Event(), list[Exception]()

        def work() -> None:
            try:
                continues = step()
            except Exception as error:  # noqa: BLE001 - the call raises it
                errors.append(error)
                continues = False
            if not continues:
                ended.set()

        job = Periodic(task.name, self._clock, lambda: PERIOD, work, wanted=lambda: not ended.is_set())
        loop.add(job)
        try:
            while not self._clock.wait(ended, PERIOD) and not task.call.stopped.is_set():
                pass
        finally:
            loop.remove(job)
        for error in errors:
            raise error

    def _own(self, task: Task, joints: Iterable[str]) -> list[str]:
        """Return the joints that no other command has taken from a task."""
        with self._changed:
            return [joint for joint in joints if self._taken.get(joint) == task.number]

    def _step(self, task: Task, trajectories: Mapping[str, Trajectory], time: float) -> None:
        """Send the setpoints to their angles at a time one period from now."""
        setpoints = self._access.angles(measured=False)
        targets, speeds = {}, {}
        for joint in self._own(task, trajectories):
            target = trajectories[joint].at(time)
            if target == setpoints[joint]:
                continue
            speed, cap = abs(target - setpoints[joint]) / PERIOD, self._body.speed_cap(joint)
            if abs(target - trajectories[joint].at(time - PERIOD)) <= cap * PERIOD:
                speed = min(speed, cap)  # catching up is no reason for a warning
            targets[joint], speeds[joint] = target, speed
        if targets:
            self._body.move(targets, speeds, client=task.call.client.name)
            self._access.balance(targets)

    def _late(self, joint: str, target: float) -> bool:
        """Return whether a setpoint still has to approach its end; that of a limp motor never does."""
        reading, index = self._body.read(), self._body.index(joint)
        setpoint, limp = reading.commands[index], reading.stiffnesses[index] == 0.0
        return (
            not limp and min(abs(setpoint - target), abs(setpoint - self._body.goal(joint).target)) > _REACHED
        )
