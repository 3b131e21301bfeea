"""Run a component in virtual time, in one thread: the same way every time, as fast as the processor.

This is how behaviors are tested. Cycles run in the order of their times; at the same time, cycles of
ancestors run first. Each cycle is a `Coroutine`: one that sleeps, or waits for anything by the clock, is left
where it does, and the others run meanwhile, as on threads. It goes on after the cycles that begin then.
"""

from __future__ import annotations

import contextvars
import heapq
import logging
import threading
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Final, NamedTuple, Protocol, cast
from weakref import ref

from zenoh_ice.threads.clock import Clock

from .._automaton import Automaton, State
from .._component_run import ComponentRun
from .._cycle import run_cycle, skip_cycle
from .._limits import LIMITS, RuntimeLimits
from .._supervision import Refusal
from .._timeline import SECOND, Timeline, slot_after, slot_at
from .._turns import patience, turn_of
from ..component import Component
from ..coroutine import Coroutine, current_coroutine, rest
from ..errors import ComponentStoppedError, CycleCutError, OnError, OnRefused
from ..observer import Observer
from ..tree import Actor, ChangeKind, Replaced, Tree
from .clock import NEVER, TaskClock, TaskTimeline

_RETRY_DELAY: Final = 1.0
"""s of the clock from a refused command until the automata try again."""
_REPORTED: Final = 3
"""Reports of the sleeps of one cycle that it is to end; code that goes on nevertheless has to wait."""
_RELUCTANT: Final = 10_000_000
"""ns that it waits for each time."""

_logger = logging.getLogger(__name__)


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
        self._changes = deque[tuple[int, Automaton, State, ChangeKind]](maxlen=kept)
        """Nobody reads most of them."""

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:
        self._changes.append((now, actor.automaton, actor.current, kind))

    @property
    def trace(self) -> list[Change]:
        made = tuple(self._changes)  # which a paced execution may extend meanwhile
        return [Change(at / SECOND, automaton.name, state.name, kind) for at, automaton, state, kind in made]


class _Cycles(Coroutine):
    """The cycles of an automaton, one after the other; each may sleep.

    To begin a `Coroutine` costs more than a short cycle.
    """

    def __init__(self, virtual: VirtualRun, actor: Actor) -> None:
        super().__init__(actor.automaton.name, partial(_run_cycles, ref(self)), contextvars.copy_context())
        self._virtual: Final = virtual
        self._at = 0
        self.actor: Actor = actor
        self.asleep = False
        """True in `self.sleep`, which ends when the cycle has to."""
        self.reports = 0
        """Number of times that its sleeps have reported that the cycle is to end."""

    def begin(self, at: int) -> None:
        """Let a cycle run, which belongs to a component time in ns, until it sleeps or ends."""
        self._at = at
        self.reports = 0
        self._virtual.cycles[self.actor] = self
        self.go()

    def go(self, answer: Any = None) -> None:  # noqa: ANN401 - of `Coroutine`
        """Let the cycle run; while it does, and when it has failed, it is the running one."""
        virtual = self._virtual
        before = virtual.running
        virtual.running = self.actor
        Coroutine.go(self, answer)
        virtual.running = before

    def close(self, error: type[BaseException]) -> None:
        """End a cycle that sleeps."""
        super().close(error)
        self._virtual.cycles.pop(self.actor, None)

    def run_one(self) -> None:
        """Run the cycle that has begun."""
        virtual, actor = self._virtual, self.actor
        try:
            virtual.run_cycle(actor, self._at)
        finally:
            virtual.cycles.pop(actor, None)


def _run_cycles(reference: Callable[[], _Cycles | None]) -> None:
    while (cycles := reference()) is not None:
        cycles.run_one()
        del cycles  # who has dropped the component need not close it
        rest()


class _VirtualTree(Tree):
    """The automata of a component in virtual time: who waits for a cycle lets it run meanwhile."""

    def __init__(self, virtual: VirtualRun, root: Automaton) -> None:
        super().__init__(root)
        self._virtual: Final = virtual

    def wait_for_cycles(self, actor: Actor, timeout: float) -> list[Actor]:
        """Wait until no automaton below the current state is in a cycle; return the ones that still are."""
        if len(self._virtual.cycles) == 1:  # that of the one who waits
            return []
        below = {actor for child in actor.below for actor in (child, *child.descendants())}
        return self._virtual.let_end(below, timeout)

    def wait_for_gap(self, timeout: float) -> bool:
        """Wait, under the lock, for a moment without any cycle; false if there is none."""
        if not self._virtual.is_driven_here:
            return super().wait_for_gap(timeout)
        return not self._virtual.let_end(set(self.actors), 0.0)


class VirtualRun(ComponentRun):
    """A component that runs while `advance` is called.

    Proxies are not connected: assign stand-ins to the component's attributes. `trace` has every change since
    the start, including the entry into the initial states, or the newest `kept`. Code that sleeps goes on
    when `advance` reaches the end of its sleep; the other automata run meanwhile. When the root has finished,
    nothing runs any more. `on_end` is called once when an error or its root has ended it, before the time
    advances further. While `refusal` is set, a refused command pauses the component: `time` stands still, and
    after each second of the clock the automata try again if `commands_accepted` returns true; its argument is
    the reported holder of the robot. A pause by a client lets the clock stand still, too.
    With `starts` the initial states are entered at once, otherwise by `start`.
    User code sees the `clock`; `timeline`, by default on that clock, is component time, and `tree` makes the
    automata's tree. A replay has its own ones, and says which cycle is next by `run_cycle`. One thread at a
    time drives it, always the same one while code sleeps.
    """

    clock: AdvancedClock

    def __init__(
        self,
        component: Component,
        *,
        clock: AdvancedClock | None = None,
        timeline: Timeline | None = None,
        tree: Callable[[Automaton], Tree] | None = None,
        on_error: str | None = None,
        on_refused: str | None = None,
        on_end: Callable[[], None] | None = None,
        commands_accepted: Callable[[str], bool] = lambda _holder: True,
        observers: Iterable[Observer] = (),
        kept: int | None = None,
        starts: bool = True,
        limits: RuntimeLimits = LIMITS,
    ) -> None:
        self._on_end = on_end or (lambda: None)
        self._commands_accepted = commands_accepted
        clock = clock or TaskClock()
        self._task_clock = cast("TaskClock", clock)  # that of a replay, which is none, drives no cycles here
        self._retry_at: float | None = None
        """The time of the clock at which the automata try again after a refused command."""
        self._is_wound_up = False
        self.running: Actor | None = None
        """The automaton whose cycle runs, or has ended the component."""
        self.cycles: dict[Actor, _Cycles] = {}
        """The automata in a cycle that has begun and not ended."""
        self._kept: dict[Actor, _Cycles] = {}
        """The code of the automata that have begun a cycle."""
        self._followers: set[Actor] = set()
        """The automata that wait for another one's cycle, which sleeps."""
        self._driver = threading.get_ident()
        self._woken = False
        """Set when code that sleeps may have to end its cycle."""
        super().__init__(
            component,
            clock,
            None if on_error is None else OnError(on_error),
            None if on_refused is None else OnRefused(on_refused),
            timeline=timeline or TaskTimeline(self._task_clock),
            tree=tree or partial(_VirtualTree, self),
            ordered=tree is None,
            limits=limits,
        )
        self._tracer = _Tracer(kept)
        for each in (self._tracer, *observers):
            self.tree.observers.append(each)
        self._due: list[tuple[int, int, Actor]] = [
            (0, index, actor) for index, actor in enumerate(self.tree.actors)
        ]
        if starts:
            self.start()

    @property
    def time(self) -> float:
        """The component time in s."""
        return self.component_time.now() / SECOND

    @property
    def trace(self) -> list[Change]:
        """Every change since the start, or the newest ones that are kept."""
        return self._tracer.trace

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
        self.proofs.start()

    @property
    def is_driven_here(self) -> bool:
        """Whether this is the thread that runs the cycles."""
        return threading.get_ident() == self._driver

    def advance(self, seconds: float) -> None:
        """Run all cycles that fall due in the next `seconds`, the end included; none once it has ended.

        The seconds are those of the clock, which runs while a refused command pauses the component.
        """
        self._driver = threading.get_ident()
        end = self.component_time.now() + round(seconds * SECOND)
        ended, clock = self.ended, self._task_clock
        while not ended.is_set():
            if self._woken:
                self.end_sleeps()
            if self.refusal is not None:
                end -= self._sit_out(end - self.component_time.now())
                clock.wake_due()
                if self.refusal is not None:
                    return
            elif self.component_time.paused:
                return
            due = self._due[0][0] if self._due else NEVER
            wake = self._next_wake() if clock.asleep else NEVER
            if due > end and wake > end:
                break
            if due <= wake:
                self._run_next(self._move_to(due))
            else:
                self._move_to(wake)
                clock.advance(0.0)
                clock.wake_due()
                self._let_late_ones_begin()
        self._wind_up()
        self._move_to(end)

    def run_cycle(self, actor: Actor, at: int) -> None:
        """Run one cycle of an automaton, which belongs to a component time in ns; a ghost runs none."""
        run_cycle(self.tree, actor, at, self._supervision)

    def end_sleeps(self) -> None:
        """Let the cycles that have to end, and sleep by `self.sleep`, go on: their sleep ends."""
        self._woken = False
        for cycle in tuple(self.cycles.values()):
            if cycle.asleep and (self.ended.is_set() or not self.tree.may_go_on(cycle.actor)):
                self._task_clock.wake(cycle)

    def let_end(self, actors: set[Actor], timeout: float) -> list[Actor]:
        """Let the running cycles of some automata end, for at most `timeout` s; return those that do not."""
        self.end_sleeps()
        self._task_clock.wait_for(lambda: actors.isdisjoint(self.cycles), timeout)
        return [actor for actor in self.tree.actors if actor in actors and actor in self.cycles]

    def end_cycles(self) -> None:
        """End all code that sleeps or waits, since the component has ended."""
        if self.is_driven_here:
            self._task_clock.end_sleepers(ComponentStoppedError)
            self._kept.clear()

    def replace(
        self, component: Component, actors: tuple[Actor, ...], apply: Callable[[int], Replaced]
    ) -> float:
        """Replace the component with another version of it, see `ComponentRun`."""

        def apply_it(now: int) -> Replaced:
            replaced = apply(now)
            self._schedule(now)
            return replaced

        return super().replace(component, actors, apply_it)

    def changes(self, automaton: str) -> list[tuple[float, str]]:
        """Return the states that an automaton has entered, the initial one included, each with its time."""
        return [
            (change.time, change.state)
            for change in self.trace
            if change.automaton == automaton and change.kind is ChangeKind.ENTERED
        ]

    def _next_wake(self) -> int:
        """Return the component time in ns at which code that sleeps goes on; `NEVER` if none does."""
        clock = self._task_clock
        if not clock.asleep:
            return NEVER
        return self.component_time.now() + max(0, clock.asleep[0][0] - clock.moment)

    def _run_next(self, now: int) -> None:
        """Run the next cycle that is due and does anything, unless the automaton has to wait."""
        schedule, tree = self._due, self.tree
        alone = not (self.cycles or self._followers)
        while True:
            due, index, actor = schedule[0]
            if due > now:
                return
            interval = actor.automaton.interval
            slot = slot_at(now, interval)
            if not (alone and skip_cycle(tree, actor, slot, self._supervision)):
                break
            heapq.heapreplace(schedule, (slot + interval, index, actor))
        heapq.heappop(schedule)
        if self._followers:
            self._followers.discard(actor)
        turn: int | Actor = slot
        following = slot + interval
        try:
            if self.cycles:
                if actor in self.cycles:
                    return
                if actor.active and not actor.finished and actor.cycle.next_slot <= now:
                    turn = turn_of(actor, now, now)
            if isinstance(turn, int):
                try:
                    self._begin(actor, turn)
                finally:
                    following = self._next(actor, due, turn)
            else:
                following = (now if turn.cycle.began is None else turn.cycle.began) + patience(actor, turn)
                self._followers.add(actor)
        finally:  # Ctrl-C in a notebook, or a task that fails, must not end the cycles of an automaton
            if schedule is self._due:  # otherwise a reload has scheduled all automata
                heapq.heappush(schedule, (following, index, actor))

    def _begin(self, actor: Actor, at: int) -> None:
        """Let a cycle begin, and run until it sleeps or ends."""
        code = self._kept.get(actor)
        if code is None or code.ended:
            code = self._kept[actor] = _Cycles(self, actor)
        code.begin(at)
        if self._followers:
            self._let_late_ones_begin()

    def _let_late_ones_begin(self) -> None:
        """Schedule at once automata that waited for code that slept: for its decision, or its entry."""
        with self.tree.lock:
            self._due[:] = [
                (
                    min(due, actor.cycle.next_slot)
                    if actor.active and not actor.finished and actor not in self.cycles
                    else due,
                    index,
                    actor,
                )
                for due, index, actor in self._due
            ]
            heapq.heapify(self._due)
            self._followers.clear()

    def _next(self, actor: Actor, due: int, at: int) -> int:
        """Return when an automaton is due again; at once if a pause came before its cycle."""
        held = self.tree.held and actor.active and not actor.finished and actor not in self.cycles
        if held and actor.cycle.last_slot < at:
            return due
        return max(actor.cycle.next_slot, at + actor.automaton.interval)

    def _schedule(self, now: int) -> None:
        """Let the next cycle of each automaton be the first after a time."""
        actors = self.tree.actors
        self._due = sorted(
            (slot_after(now, actor.automaton.interval), index, actor) for index, actor in enumerate(actors)
        )

    def _step(self, actors: tuple[Actor, ...]) -> None:
        active = [actor for actor in actors if actor.active and not actor.finished]
        if not self.component_time.paused or not active:
            return
        duration = min(actor.automaton.interval for actor in active)
        self.component_time.step(duration)
        self.clock.advance(duration / SECOND)
        now = self.component_time.now()
        for actor in active:
            if self.ended.is_set():
                break
            if actor in self.cycles:
                continue
            actor.stepping = True
            self._begin(actor, now)
            if self.let_end({actor}, self._limits.step):
                name, limit = actor.automaton.name, self._limits.step
                _logger.warning("the step of %s takes longer than %g s", name, limit)
        with self.tree.lock:
            self._schedule(now)
        self._wind_up()

    def _wind_up(self) -> None:
        """Once it has ended, in a cycle or by another thread, end the cycles and what they drive."""
        if not self.ended.is_set():
            return
        self.end_cycles()
        if not self._is_wound_up:
            self._is_wound_up = True
            self._on_end()

    def _actor_here(self) -> Actor | None:
        code = current_coroutine()
        return None if code is None else code.actor

    def _sleep(self, seconds: float) -> None:
        cycle = current_coroutine()
        if not isinstance(cycle, _Cycles):
            self.clock.advance(max(0.0, seconds))
            return
        clock = self._task_clock
        end = clock.moment + round(seconds * SECOND)
        while True:
            ended = self.ended.is_set()
            if ended or not self.tree.may_go_on(cycle.actor):
                cycle.reports += 1
                if cycle.reports > _REPORTED:
                    clock.rest_until(clock.moment + _RELUCTANT)
                raise ComponentStoppedError if ended else CycleCutError
            if clock.moment >= end:
                return
            cycle.asleep = True
            try:
                clock.rest_until(end)
            finally:
                cycle.asleep = False

    def _wake(self) -> None:
        self._woken = True

    def _move_to(self, when: int) -> int:
        """Advance the time to `when`, and return it; tasks of the clock may advance it further."""
        now = self.component_time.now()
        if now >= when:
            return now
        clock = self._task_clock
        clock.move_to(clock.moment + when - now)
        return self.component_time.now()

    def _pause_after(self, refusal: Refusal) -> None:
        super()._pause_after(refusal)
        self._retry_at = None

    def _sit_out(self, longest: int) -> int:
        """Let the clock run until the automata may try again; return how long that took in ns."""
        taken = 0
        while (refusal := self.refusal) is not None:
            if self._retry_at is None:
                self._retry_at = self.clock.now() + _RETRY_DELAY
            left = round((self._retry_at - self.clock.now()) * SECOND)
            if left <= 0:
                self._retry_at = None
                if self._commands_accepted(refusal.holder):
                    self.resume(refusal)
                continue
            if taken >= longest:
                break
            wait = min(longest - taken, left)
            self.clock.advance(wait / SECOND)
            taken += wait
        return taken


def run(component: Component, seconds: float) -> VirtualRun:
    """Run a component for some seconds of virtual time and return what happened."""
    virtual = VirtualRun(component)
    virtual.advance(seconds)
    return virtual
