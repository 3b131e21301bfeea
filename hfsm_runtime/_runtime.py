"""A component that runs on threads, one for each automaton, by its clock."""

from __future__ import annotations

import heapq
import logging
import sys
import threading
import time
from collections.abc import Callable
from itertools import count
from types import FrameType
from typing import Final

from ._actor import wake_next
from ._component_run import ComponentRun
from ._cycle import run_cycle, skip_cycle
from ._limits import RuntimeLimits
from ._supervision import Refusal
from ._timeline import Timeline, delay_in_slot
from ._turns import patience, turn_of
from .component import Component
from .errors import ComponentStoppedError, CycleCutError, ReloadRefusedError
from .observer import Observer
from .tree import Actor, ChangeKind, Replaced

_logger = logging.getLogger(__name__)

_RESOLUTION: Final = 1e-9
"""Seconds; sums of floats are not exact."""

_ALARM_ENDS: Final = 1.0
"""The longest wait in wall seconds for the thread of the alarm to end."""


class Runtime(ComponentRun, Observer):
    """A component whose automata run on threads, by its clock. Start and stop it once.

    An idle thread rests for as long as the `limits` say; any change wakes it.
    """

    def _prepare(self) -> None:
        self._asked: Refusal | None = None
        self._ask_at = 0.0
        self._stopping = False
        self._one_step = threading.Lock()
        self._own = threading.local()
        # Automata higher up wake earlier in their slots: most have decided by the time the others wake.
        by_depth = sorted(self.tree.actors, key=lambda actor: actor.depth)
        self._workers = {actor: _Worker(self, actor, index) for index, actor in enumerate(by_depth)}
        self._alarm = Alarm(self.component_time, self._limits.idle)
        self.tree.observers.append(self)

    def start(self) -> None:
        """Enter the initial states and start the cycles."""
        self.component_time.restart()
        self.tree.start(0)
        self.proofs.start()
        self._alarm.start()
        for worker in self._workers.values():
            worker.thread.start()

    def stop(self) -> None:
        """End the automata: running cycles end, or are logged as errors after 2 s.

        It may be called from user code, which it does not wait for.
        """
        self.request_stop()
        self._stopping = True
        self._wake()
        for worker in self._workers.values():
            worker.stepped.set()  # nobody must wait for a step that will not run any more
        self._alarm.stop()
        deadline = time.monotonic() + self._limits.stop
        threads = [worker.thread for worker in self._workers.values() if worker.thread.ident is not None]
        for thread in threads:
            if thread is not threading.current_thread():
                thread.join(max(0.0, deadline - time.monotonic()))
        for actor, worker in self._workers.items():
            if worker.thread.is_alive():
                self._abandon(actor, self._limits.stop)

    def retry(self, commands_accepted: Callable[[str], bool]) -> None:
        """Resume after a refused command if commands are accepted again; call it often.

        `commands_accepted` is called with the reported holder of the robot: at once, to see why commands are
        refused, and then at most once a second. If commands are refused again, the component pauses again.
        """
        refusal = self.refusal
        if refusal is None:
            return
        first = self._asked is not refusal
        if not first and time.monotonic() < self._ask_at:
            return
        self._asked, self._ask_at = refusal, time.monotonic() + self._limits.retry
        if commands_accepted(refusal.holder) and not first:
            self.resume(refusal)

    def replace(
        self, component: Component, actors: tuple[Actor, ...], apply: Callable[[int], Replaced]
    ) -> float:
        """Replace the component with another version of it, see `ComponentRun`.

        Raises ReloadRefusedError also when there are no threads for new automata.
        """
        leaving = joining = tuple(actor for actor in actors if self.tree.actor(actor.automaton.id) is None)

        def apply_it(now: int) -> Replaced:
            nonlocal leaving
            replaced = apply(now)
            leaving = replaced.gone
            return replaced

        try:
            self._add(joining)
            return super().replace(component, actors, apply_it)
        finally:
            self._remove(leaving)
            self._wake()

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Wake the thread of an automaton, at once or when its next cycle falls due."""
        worker = self._workers[actor]
        if actor.in_cycle:
            worker.wake.set()  # its code may sleep
        elif kind in (ChangeKind.ENTERED, ChangeKind.RESUMED):
            self._alarm.set_at(actor.cycle.next_slot + worker.delay, worker.wake)

    def guard(self, worker: _Worker) -> None:
        """Run an automaton, and report when its thread ends before its time; the body of the thread."""
        self._own.worker = worker
        try:
            self._run_cycles(worker)
        except BaseException as error:  # noqa: BLE001 - nothing may end a thread without being reported
            if not isinstance(error, ComponentStoppedError):
                self._supervision.crashed(worker.actor, error)

    def _run_cycles(self, worker: _Worker) -> None:
        """Run the cycles of one automaton until the end."""
        actor, timeline = worker.actor, self.component_time
        interval = 0
        usual = 0
        while True:
            worker.wake.clear()  # before the checks: later changes set it again
            if self._stopping or worker.retired:
                return
            if actor.stepping:
                run_cycle(self.tree, actor, timeline.now(), self._supervision)
                worker.stepped.set()
            elif self.tree.held or not actor.active or actor.finished:
                worker.wake.wait(self._limits.idle)
            else:
                if actor.automaton.interval != interval:  # at first, and when the automaton was replaced
                    interval, usual = actor.automaton.interval, worker.delay
                now = timeline.now()
                delay = 0 if actor.cycle.followers else usual
                if now - delay < actor.cycle.next_slot:
                    timeline.wait_until(actor.cycle.next_slot + delay, worker.wake)
                    continue
                turn = turn_of(actor, now, now - delay)
                if isinstance(turn, Actor):
                    self._follow(worker, turn)
                elif not skip_cycle(self.tree, actor, turn, self._supervision):
                    run_cycle(self.tree, actor, turn, self._supervision)

    def _follow(self, worker: _Worker, first: Actor) -> None:
        """Wait until the cycle of another automaton, which comes first, is decided or lasts too long."""
        actor, queue = worker.actor, first.cycle.followers
        queue[worker.wake] = None
        now = self.component_time.now()
        if turn_of(actor, now, now) is first:  # if not, it was decided before it knew who follows
            leader = self._workers.get(first)
            if leader is not None:
                leader.wake.set()  # it need not wake later in its slot
            since = now if first.cycle.began is None else first.cycle.began
            self.component_time.wait_until(since + patience(actor, first), worker.wake)
        if queue.pop(worker.wake, self) is self:  # it was released
            wake_next(queue)

    def _step(self, actors: tuple[Actor, ...]) -> None:
        with self._one_step:
            with self.tree.lock:
                active = [actor for actor in actors if actor.active and not actor.finished]
                if self._stopping or not self.component_time.paused or not active:
                    return
                self.component_time.step(min(actor.automaton.interval for actor in active))
            for actor in active:
                worker = self._workers.get(actor)
                if worker is None:  # it has left the tree in the meantime
                    continue
                worker.stepped.clear()
                with self.tree.lock:
                    ordered = actor.stepping = not self.ended.is_set()
                if not ordered:
                    return
                worker.wake.set()
                if not worker.stepped.wait(self._limits.step):
                    name, limit = actor.automaton.name, self._limits.step
                    _logger.warning("the step of %s takes longer than %g s", name, limit)

    def _sleep(self, seconds: float) -> None:
        worker: _Worker | None = getattr(self._own, "worker", None)
        if worker is None:  # on a thread that is not an automaton's
            self.clock.wait(self.ended, max(0.0, seconds))
        else:
            self._sleep_in_cycle(worker, seconds)
        if self.ended.is_set():
            raise ComponentStoppedError

    def _sleep_in_cycle(self, worker: _Worker, seconds: float) -> None:
        """Wait, until the end of the component at most; raises CycleCutError when the cycle is to end."""
        end = self.clock.now() + seconds
        worker.asleep = True
        try:
            while not self.ended.is_set():
                worker.wake.clear()
                if not self.tree.may_go_on(worker.actor):
                    raise CycleCutError
                left = end - self.clock.now()
                if left < _RESOLUTION:  # a clock of whole ns would not wait for less, and so never end
                    break
                self.clock.wait(worker.wake, left)
        finally:
            worker.asleep = False

    def _actor_here(self) -> Actor | None:
        worker: _Worker | None = getattr(self._own, "worker", None)
        return None if worker is None else worker.actor

    def _frame(self, actor: Actor) -> FrameType | None:
        worker = self._workers.get(actor)
        if worker is None or worker.asleep:
            return None
        return sys._current_frames().get(worker.thread.ident or 0)

    def _add(self, actors: tuple[Actor, ...]) -> None:
        """Start the threads of automata that are about to join the tree.

        Raises ReloadRefusedError where the system gives the process no more threads; some may run then.
        """
        workers = {
            actor: _Worker(self, actor, index) for index, actor in enumerate(actors, len(self._workers))
        }
        self._workers = {**self._workers, **workers}
        try:
            for worker in workers.values():
                worker.thread.start()
        except RuntimeError as error:
            raise ReloadRefusedError(f"{len(actors)} automata need a thread each: {error}") from error

    def _remove(self, actors: tuple[Actor, ...]) -> None:
        """End the threads of automata that are not in the tree, and in no cycle."""
        leaving = set(actors)
        retired = [worker for actor, worker in self._workers.items() if actor in leaving]
        self._workers = {actor: worker for actor, worker in self._workers.items() if actor not in leaving}
        for worker in retired:
            worker.retired = True
            worker.wake.set()
            worker.stepped.set()
        for worker in retired:
            if worker.thread.ident is not None:
                worker.thread.join(self._limits.step)

    def _wake(self) -> None:
        """Wake every thread to check for changes, such as the end of a pause."""
        self._alarm.recheck()
        for worker in self._workers.values():
            worker.wake.set()


class _Worker:
    """An automaton's thread and what wakes it."""

    def __init__(self, runtime: Runtime, actor: Actor, index: int) -> None:
        self.actor = actor
        self.index = index
        self.retired = False
        self.asleep = False
        self.wake = threading.Event()
        self.stepped = threading.Event()
        self.thread = threading.Thread(
            target=runtime.guard, args=(self,), name=f"automaton {actor.automaton.name}", daemon=True
        )

    @property
    def delay(self) -> int:
        """How long after the beginning of its slots it wakes, in ns."""
        return delay_in_slot(self.index, self.actor.automaton.interval)


class Alarm:
    """Sets events at component times in ns, on its own thread. Start and stop it once.

    Entering a state may wake hundreds of automata, whose threads would all compete for the interpreter only
    to find out that their first cycles are spread over the period.
    """

    def __init__(self, timeline: Timeline, idle: float = RuntimeLimits.idle) -> None:
        self._timeline = timeline
        self._idle = idle
        self._lock = threading.Lock()
        self._due: list[tuple[int, int, threading.Event]] = []
        self._numbers = count()
        self._news = threading.Event()
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="alarm", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread; events that are not due yet are never set."""
        self._stopping = True
        self._news.set()
        if self._thread.ident is not None and self._thread is not threading.current_thread():
            self._thread.join(_ALARM_ENDS)

    def set_at(self, due: int, event: threading.Event) -> None:
        """Set an event at a time, or at once when it is past."""
        with self._lock:
            first = not self._due or due < self._due[0][0]
            heapq.heappush(self._due, (due, next(self._numbers), event))
        if first:
            self._news.set()

    def recheck(self) -> None:
        """Check the time again: it has stood still, or was far from the next alarm."""
        self._news.set()

    def _run(self) -> None:
        while True:
            self._news.clear()  # before the checks: later changes set it again
            if self._stopping:
                return
            due = self._set_due()
            if due is None:
                self._news.wait(self._idle)
            else:
                self._timeline.wait_until(due, self._news)

    def _set_due(self) -> int | None:
        """Set the events whose time has come; return that of the next, if any."""
        now = self._timeline.now()
        with self._lock:
            while self._due and self._due[0][0] <= now:
                heapq.heappop(self._due)[2].set()
            return self._due[0][0] if self._due else None
