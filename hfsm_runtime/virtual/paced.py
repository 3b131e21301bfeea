"""An execution whose time passes by itself: as fast as wall time, times a speed."""

from __future__ import annotations

import logging
import math
import sys
import threading
from collections import deque
from types import FrameType
from typing import Any, Final

from .._stop import stop_robot
from .._supervision import Refusal
from ..component import Component
from ..errors import ComponentStoppedError, ValueTypeError
from ..tree import Actor
from .clock import MOVE_PERIOD, PacedClock
from .execution import Execution
from .world import VirtualWorld

THREAD: Final = "virtual time"
"""The name of the thread that runs the cycles."""
_SECOND: Final = 1_000_000_000
_HIGHEST_SPEED: Final = 100.0

_logger = logging.getLogger(__name__)


class PacedExecution(Execution):
    """An execution whose time passes by itself, `speed` seconds in a wall second; the clock is a PacedClock.

    Life: `start` enters the initial states and starts a thread, which runs all cycles, and the tasks of the
    world; `stop` ends it. It may be paused, stepped and reloaded meanwhile, by any thread, so that a monitor
    may be served. In a pause all time stands still, and a step moves it by a period. Code that hangs holds
    the others up; `stop` abandons it after 2 s.

    Errors: without `on_error` the policy of the document applies, and `advance` raises BehaviorFailed.
    """

    clock: PacedClock

    def __init__(self, component: Component, world: VirtualWorld, **options: Any) -> None:  # noqa: ANN401 - of Execution
        self._thread: Final = threading.Thread(target=self._drive, name=THREAD, daemon=True)
        self._one_step: Final = threading.Lock()
        self._steps: Final = deque[tuple[tuple[Actor, ...], threading.Event]]()
        super().__init__(component, world, starts=False, **options)
        self.speed = 1.0

    def start(self) -> None:
        """Enter the initial states, and let time pass."""
        super().start()
        self._thread.start()

    def advance(self, seconds: float) -> None:
        """Wait until a duration has passed, or the component has ended or is paused by a client.

        Raises as that of `Execution`.
        """
        end = self.clock.now() + seconds
        while not self.paused_by_client and (left := end - self.clock.now()) > 0:
            if self.ended.wait(min(left / self.speed, MOVE_PERIOD)):
                break
        self._check()

    def pause(self) -> None:
        """Let all time stand still, and start no cycle until `resume`."""
        self.clock.pause()  # first: else it could move on while the time of the component stands still
        super().pause()

    def resume(self, after: Refusal | None = None) -> None:
        """Resume after a pause, or only after the pause for one refused command."""
        super().resume(after)
        if not self.component_time.paused:
            self.clock.resume()

    def set_speed(self, speed: float) -> None:
        """Set the speed of time, in s per wall second. Raises ValueTypeError for an invalid speed."""
        if not (math.isfinite(speed) and 0.0 < speed <= _HIGHEST_SPEED):
            raise ValueTypeError(f"the speed is more than 0 and at most {_HIGHEST_SPEED:g}, not {speed:g}")
        self.speed = speed
        self.clock.set_speed(speed)

    def request_stop(self) -> None:
        """Let no further cycle begin, and set `ended`; returns at once."""
        super().request_stop()
        self.clock.end()

    def stop(self) -> None:
        """End the thread: a running cycle ends, or is logged as an error after 2 s."""
        self.request_stop()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(self._limits.stop)
            if self._thread.is_alive() and (actor := self.running) is not None:
                self._abandon(actor, self._limits.stop)

    def close(self) -> None:
        """End the thread and the world."""
        try:
            if "tree" in vars(self):  # otherwise it could not be made
                self.stop()
        finally:
            super().close()

    def _drive(self) -> None:
        """Let time pass, and run the cycles that fall due, until the end; the body of the thread."""
        self._driver = threading.get_ident()
        self._time_module.take_over()
        self.clock.drive()
        try:
            while not self.ended.is_set():
                if self._steps:
                    self._take_step()
                elif self._woken or (self.clock.move(self._until_next()) and self._is_due()):
                    self._run_cycles(0.0)
        except ComponentStoppedError:
            pass
        except BaseException as error:  # noqa: BLE001 - nothing may end the thread without being reported
            self._supervision.crashed(self.running or self.tree.root, error)
            stop_robot(self.component)
        finally:
            self.end_cycles()
            while self._steps:
                self._steps.popleft()[1].set()

    def _until_next(self) -> float:
        """Return the seconds until a cycle is due, or until the clock is to be seen moving."""
        moment = self._next_wake() if self.component_time.paused else self._next_moment()
        return min(MOVE_PERIOD * self.speed, max(0, moment - self.component_time.now()) / _SECOND)

    def _is_due(self) -> bool:
        return self.refusal is not None or self._next_moment() <= self.component_time.now()

    def _next_moment(self) -> int:
        """Return the component time in ns at which a cycle begins or goes on."""
        with self.tree.lock:
            return min(self._due[0][0], self._next_wake())

    def _step(self, actors: tuple[Actor, ...]) -> None:
        with self._one_step:
            done = threading.Event()
            self._steps.append((actors, done))
            self._wake()
            if not done.wait(self._limits.step):
                _logger.warning("the step takes longer than %g s", self._limits.step)

    def _take_step(self) -> None:
        actors, done = self._steps.popleft()
        try:
            with self.clock.unpaced(), self._time_module.shown_to(self.component):
                super()._step(actors)
        finally:
            done.set()

    def _frame(self, actor: Actor) -> FrameType | None:
        if actor is not self.running:
            return None
        return sys._current_frames().get(self._thread.ident or 0)

    def _wake(self) -> None:
        super()._wake()
        self.clock.interrupt()
