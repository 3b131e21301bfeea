"""Move joints along trajectories, one task per call, as NAOqi does."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from naoserver_qi.access import PERIOD, Access
from naoserver_qi.calls import Call
from naoserver_qi.trajectory import Trajectory

__all__ = ["JointTasks", "Task"]

_SETTLING: Final = 3.0
"""Robot seconds that joints get to arrive after the end of a trajectory that was too fast for them."""
_REACHED: Final = 1e-6  # rad
_POLL: Final = 0.1
"""Wall seconds between two checks whether a waiting call was cancelled."""


@dataclass(frozen=True, slots=True)
class Task:
    """A call that moves joints."""

    number: int
    name: str
    joints: frozenset[str]
    call: Call


class JointTasks:
    """Move the joints of a body. Of two tasks that want the same joint the later waits for the earlier."""

    def __init__(self, access: Access) -> None:
        self._access = access
        self._body = access.body
        self._clock = access.robot.clock
        self._changed = threading.Condition()
        self._tasks: list[Task] = []
        self._taken: dict[str, int] = {}  # the task that moves each joint
        self._count = 0

    def all(self) -> list[Task]:
        """Return the tasks that move joints or wait for them."""
        with self._changed:
            return list(self._tasks)

    def stop(self, tasks: Iterable[Task]) -> None:
        """Cancel tasks; their joints stay where they are."""
        for task in tasks:
            task.call.stopped.set()

    def take(self, joints: Iterable[str]) -> None:
        """Take joints away from the tasks that move them, which go on with the others."""
        with self._changed:
            for joint in joints:
                self._taken.pop(joint, None)

    @contextmanager
    def task(self, name: str, joints: Iterable[str], call: Call) -> Iterator[Task]:
        """Move joints in a `with` block, which begins when no other task moves them."""
        with self._changed:
            self._count += 1
            task = Task(self._count, name, frozenset(joints), call)
            self._tasks.append(task)
            while not call.stopped.is_set() and not self._taken.keys().isdisjoint(task.joints):
                self._changed.wait(_POLL)
            if not call.stopped.is_set():  # who gave up waiting takes nothing away
                self._taken.update(dict.fromkeys(task.joints, task.number))
        try:
            yield task
        finally:
            with self._changed:
                self._tasks.remove(task)
                for joint in [joint for joint, number in self._taken.items() if number == task.number]:
                    del self._taken[joint]
                self._changed.notify_all()

    def follow(self, task: Task, trajectories: Mapping[str, Trajectory]) -> None:
        """Follow trajectories from now on, to their ends; returns earlier when the call is cancelled.

        Raises InvalidCommand and CommandRefused as `GuardedDevice.move` does.
        """
        self._body.require()  # also when nothing is left to move
        end = max(trajectory.duration for trajectory in trajectories.values())
        begin = self._clock.now()
        while not task.call.stopped.is_set():
            time = self._clock.now() - begin
            ahead = min(time + PERIOD, end)
            self._step(task, trajectories, ahead)
            if ahead >= end:
                break
            task.call.wait(PERIOD)
        self._settle(task, {joint: path.at(end) for joint, path in trajectories.items()})

    def _step(self, task: Task, trajectories: Mapping[str, Trajectory], time: float) -> None:
        """Send the setpoints to where they are to be at a time one period from now."""
        setpoints = self._access.angles(measured=False)
        with self._changed:
            own = [joint for joint in trajectories if self._taken.get(joint) == task.number]
        targets, speeds = {}, {}
        for joint in own:
            target = trajectories[joint].at(time)
            if target == setpoints[joint]:
                continue
            speed, cap = abs(target - setpoints[joint]) / PERIOD, self._body.speed_cap(joint)
            if abs(target - trajectories[joint].at(time - PERIOD)) <= cap * PERIOD:
                speed = min(speed, cap)  # to catch up is no reason for a warning
            targets[joint], speeds[joint] = target, speed
        if targets:
            self._body.move(targets, speeds)

    def _settle(self, task: Task, targets: Mapping[str, float]) -> None:
        """Wait until the setpoints have arrived; full speed where they are late."""
        end = self._clock.now() + _SETTLING
        while not task.call.stopped.is_set() and self._clock.now() < end:
            setpoints = self._access.angles(measured=False)
            with self._changed:
                late = {
                    joint: target
                    for joint, target in targets.items()
                    if self._taken.get(joint) == task.number and abs(setpoints[joint] - target) > _REACHED
                }
            late = {joint: target for joint, target in late.items() if self._moves(joint)}
            if not late:
                return
            task.call.wait(PERIOD)

    def _moves(self, joint: str) -> bool:
        goal = self._body.goal(joint)
        return abs(self._body.read().commands[self._body.index(joint)] - goal.target) > _REACHED
