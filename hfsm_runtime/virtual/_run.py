"""Run a component in virtual time, in one thread: the same way every time, as fast as the processor.

This is how behaviors are tested. Cycles run in the order of their times; at the same time, cycles of
ancestors run first.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Iterable, MutableSequence
from typing import Final, NamedTuple, Protocol

from zenoh_ice.clock import Clock, VirtualClock

from .._automaton import Automaton
from .._component_run import ComponentRun
from .._cycle import run_cycle
from .._limits import LIMITS, RuntimeLimits
from .._supervision import Refusal
from .._timeline import Timeline, slot_after, slot_at
from ..component import Component
from ..errors import OnError, OnRefused
from ..observer import Observer
from ..tree import ChangeKind, Replaced, Run, Tree

_SECOND: Final = 1_000_000_000
_RETRY_DELAY: Final = 1.0
"""s of the clock from a refused command until the automata try again."""


class Change(NamedTuple):
    """A change at a time in s: an automaton entered a state, became a ghost, resumed, or finished."""

    time: float
    automaton: str
    state: str
    kind: ChangeKind = ChangeKind.ENTERED


class AdvancedClock(Clock, Protocol):
    """A clock that moves when `advance` is called."""

    def advance(self, seconds: float) -> None:
        """Let a duration in s pass."""


class _Tracer(Observer):
    def __init__(self, kept: int | None) -> None:
        self.changes: MutableSequence[Change] = [] if kept is None else deque(maxlen=kept)

    def changed(self, now: int, run: Run, kind: ChangeKind) -> None:
        self.changes.append(Change(now / _SECOND, run.automaton.name, run.current.name, kind))


class VirtualRun(ComponentRun):
    """A component that runs while `advance` is called.

    Proxies are not connected: assign stand-ins to the component's attributes. `trace` has every change since
    the start, including the entry into the initial states, or the newest `kept`. `self.sleep` advances the
    time; the cycles that fall due in the meantime run after it. When the root has finished, nothing runs any
    more. `on_end` is called once when an error or its root has ended it, before the time advances further.
    While `refusal` is set, a refused command pauses the component: `time` stands still, and after each second
    of the clock the automata try again if `commands_accepted` returns true; its argument is the reported
    holder of the robot. A pause by a client lets the clock stand still, too.
    With `starts` the initial states are entered at once, otherwise by `start`.
    User code sees the `clock`; `timeline`, by default on that clock, is component time, and `tree` makes the
    automata's tree. A replay has its own ones, and says which cycle is next by `run_cycle`.
    """

    clock: AdvancedClock

    def __init__(
        self,
        component: Component,
        *,
        clock: AdvancedClock | None = None,
        timeline: Timeline | None = None,
        tree: Callable[[Automaton], Tree] = Tree,
        on_error: str | None = None,
        on_refused: str | None = None,
        on_end: Callable[[], None] | None = None,
        commands_accepted: Callable[[str], bool] = lambda _holder: True,
        observers: Iterable[Observer] = (),
        kept: int | None = None,
        starts: bool = True,
        limits: RuntimeLimits = LIMITS,
    ) -> None:
        self._on_end = on_end
        self._commands_accepted = commands_accepted
        self._retry_at: float | None = None
        """When the automata try again after a refused command, by the clock."""
        self._running: Run | None = None
        """The automaton whose cycle runs, or has ended the component."""
        super().__init__(
            component,
            clock or VirtualClock(),
            None if on_error is None else OnError(on_error),
            None if on_refused is None else OnRefused(on_refused),
            timeline=timeline,
            tree=tree,
            limits=limits,
        )
        tracer = _Tracer(kept)
        self.tree.observers += [tracer, *observers]
        self.trace = tracer.changes
        self._due: list[tuple[int, int, Run]] = [(0, index, run) for index, run in enumerate(self.tree.runs)]
        if starts:
            self.start()

    @property
    def time(self) -> float:
        """The component time in s."""
        return self.component_time.now() / _SECOND

    @property
    def active(self) -> str:
        """The path of current states from the root down, such as `followBall/green`.

        Where a state owns several automata the path follows the first.
        """
        return self.active_paths[0]

    @property
    def active_paths(self) -> tuple[str, ...]:
        """The paths of current states from the root down, one for each branch, in their order."""
        return tuple(self.tree.root.paths())

    @property
    def finished(self) -> bool:
        """Whether the root has finished, and with it the component."""
        return self.tree.root.finished

    @property
    def halted(self) -> bool:
        """Whether an error has ended the run."""
        return self.failed and self.ended.is_set()

    def start(self) -> None:
        """Enter the initial states, at the time 0."""
        self.component_time.restart()
        self.tree.start(0)

    def advance(self, seconds: float) -> None:
        """Run all cycles that fall due in the next `seconds`, the end included; none once it has ended.

        The seconds are those of the clock, which runs while a refused command pauses the component.
        """
        end = self.component_time.now() + round(seconds * _SECOND)
        had_ended = self.ended.is_set()
        while not self.ended.is_set():
            if self.refusal is not None:
                end -= self._sit_out(end - self.component_time.now())
                if self.refusal is not None:
                    return
            elif self.component_time.paused:
                return
            with self.tree.lock:
                schedule = self._due
                if not schedule or schedule[0][0] > end:
                    break
                due, index, run = heapq.heappop(schedule)
            at = None
            try:
                at = max(due, slot_at(self._move_to(due), run.automaton.interval))
                self.run_cycle(run, at)
            finally:  # Ctrl-C in a notebook, or a task that fails, must not end the cycles of an automaton
                with self.tree.lock:
                    if schedule is self._due:  # otherwise a reload has scheduled all automata
                        following = due if at is None else self._next(run, due, at)
                        heapq.heappush(schedule, (following, index, run))
        if self.ended.is_set() and not had_ended and self._on_end is not None:
            self._on_end()
        self._move_to(end)

    def run_cycle(self, run: Run, at: int) -> None:
        """Run one cycle of an automaton, which belongs to a component time in ns; a ghost runs none."""
        self._running = run
        run_cycle(self.tree, run, at, self._supervision)
        self._running = None

    def retry(self, commands_accepted: Callable[[str], bool]) -> None:
        """Do nothing: the automata try again as time passes."""

    def replace(self, component: Component, runs: tuple[Run, ...], apply: Callable[[int], Replaced]) -> float:
        """Replace the component with another version of it, see `ComponentRun`."""

        def apply_it(now: int) -> Replaced:
            replaced = apply(now)
            self._schedule(now)
            return replaced

        return super().replace(component, runs, apply_it)

    def changes(self, automaton: str) -> list[tuple[float, str]]:
        """Return the states that an automaton has entered, the initial one included, each with its time."""
        return [
            (change.time, change.state)
            for change in tuple(self.trace)  # which a paced execution may extend meanwhile
            if change.automaton == automaton and change.kind is ChangeKind.ENTERED
        ]

    def _next(self, run: Run, due: int, at: int) -> int:
        """Return when an automaton is due again; at once if a pause came before its cycle."""
        if self.tree.held and run.active and not run.finished and run.last_slot < at:
            return due
        return max(run.next_slot, slot_after(at, run.automaton.interval))

    def _schedule(self, now: int) -> None:
        """Let the next cycle of each automaton be the first after a time."""
        runs = self.tree.runs
        self._due = [(slot_after(now, run.automaton.interval), index, run) for index, run in enumerate(runs)]
        heapq.heapify(self._due)

    def _step(self, runs: tuple[Run, ...]) -> None:
        active = [run for run in runs if run.active and not run.finished]
        if not self.component_time.paused or not active:
            return
        duration = min(run.automaton.interval for run in active)
        self.component_time.step(duration)
        self.clock.advance(duration / _SECOND)
        now = self.component_time.now()
        for run in active:
            run.stepping = True
            self.run_cycle(run, now)
        with self.tree.lock:
            self._schedule(now)

    def _sleep(self, seconds: float) -> None:
        self.clock.advance(max(0.0, seconds))

    def _move_to(self, when: int) -> int:
        """Advance the time to `when`; return the new time, which may be later."""
        now = self.component_time.now()
        if now < when:
            self.clock.advance((when - now) / _SECOND)
            now = self.component_time.now()
        return now

    def _refused(self, refusal: Refusal) -> None:
        super()._refused(refusal)
        self._retry_at = None

    def _sit_out(self, longest: int) -> int:
        """Let the clock run until the automata may try again; return how long that took in ns."""
        taken = 0
        while (refusal := self.refusal) is not None:
            if self._retry_at is None:
                self._retry_at = self.clock.now() + _RETRY_DELAY
            left = round((self._retry_at - self.clock.now()) * _SECOND)
            if left <= 0:
                self._retry_at = None
                if self._commands_accepted(refusal.holder):
                    self.resume(refusal)
                continue
            if taken >= longest:
                break
            wait = min(longest - taken, left)
            self.clock.advance(wait / _SECOND)
            taken += wait
        return taken


def run(component: Component, seconds: float) -> VirtualRun:
    """Run a component for some seconds of virtual time and return what happened."""
    virtual = VirtualRun(component)
    virtual.advance(seconds)
    return virtual
