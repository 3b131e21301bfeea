"""Run a component in virtual time, in one thread: the same way every time, as fast as the processor.

This is how behaviors are tested. Cycles run in the order of their times; at the same time, cycles of
ancestors run first.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable
from typing import Final, NamedTuple, Protocol

from interfaces.hfsm import ErrorReport
from zenoh_ice.clock import Clock, VirtualClock

from ..automaton import Automaton
from ..automaton_run import make_event
from ..component import Component, equip, make_automata
from ..cycle import run_cycle
from ..errors import OnError, OnRefused
from ..observer import Observer
from ..supervision import Refusal, Supervision
from ..timeline import Timeline, slot_after, slot_at
from ..tree import ChangeKind, Run, Tree

_SECOND: Final = 1_000_000_000
_RETRY: Final = _SECOND
"""ns of the clock from a refused command until the automata try again."""


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
    def __init__(self) -> None:
        self.changes: list[Change] = []

    def changed(self, now: int, run: Run, kind: ChangeKind) -> None:
        self.changes.append(Change(now / _SECOND, run.automaton.name, run.current.name, kind))


class VirtualRun:
    """A component that runs while `advance` is called.

    Proxies are not connected: assign stand-ins to the component's attributes. `trace` has every change since
    the start, including the entry into the initial states. `self.sleep` advances the time; the cycles that
    fall due in the meantime run after it. When the root has finished, nothing runs any more.
    `on_halt` is called once when an error has ended the run, before the time advances further.
    While `refusal` is set, a refused command pauses the component: `time` stands still, and after each second
    of the clock the automata try again if `commands_accepted` returns true; its argument is the reported
    holder of the robot.
    User code sees the `clock`; `timeline`, by default on that clock, is component time, and `tree` makes the
    automata's tree. A replay has its own ones, and says which cycle is next by `run_cycle`.
    """

    def __init__(
        self,
        component: Component,
        *,
        clock: AdvancedClock | None = None,
        timeline: Timeline | None = None,
        tree: Callable[[Automaton], Tree] = Tree,
        on_error: str | None = None,
        on_refused: str | None = None,
        on_halt: Callable[[], None] | None = None,
        commands_accepted: Callable[[str], bool] = lambda _holder: True,
        observers: Iterable[Observer] = (),
    ) -> None:
        self.component = component
        self.clock: AdvancedClock = clock or VirtualClock()
        equip(component, self.clock, self._sleep, self.send)
        self.halted = False
        self._on_halt = on_halt
        self.refusal: Refusal | None = None
        self._commands_accepted = commands_accepted
        self._until_retry = 0
        self.tree = tree(make_automata(component))
        tracer = _Tracer()
        self.tree.observers += [tracer, *observers]
        self.trace = tracer.changes
        self._timeline = timeline or Timeline(self.clock)
        self._supervision = Supervision(
            self.tree,
            self._timeline,
            component,
            None if on_error is None else OnError(on_error),
            None if on_refused is None else OnRefused(on_refused),
            halt=self._halt,
            refused=self._refused,
        )
        self._due = [(0, index) for index in range(len(self.tree.runs))]
        self.tree.start(0)

    @property
    def time(self) -> float:
        """The component time in s."""
        return self._timeline.now() / _SECOND

    @property
    def errors(self) -> tuple[ErrorReport, ...]:
        """The newest errors, oldest first."""
        return self._supervision.records

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

    def advance(self, seconds: float) -> None:
        """Run all cycles that fall due in the next `seconds`, the end included; none once it has ended.

        The seconds are those of the clock, which runs while a refused command pauses the component.
        """
        end = self._timeline.now() + round(seconds * _SECOND)
        was_halted = self.halted
        while not (self.halted or self.finished):
            if self.refusal is not None:
                end -= self._sit_out(end - self._timeline.now())
                if self.refusal is not None:
                    return
            if not self._due or self._due[0][0] > end:
                break
            due, index = heapq.heappop(self._due)
            run = self.tree.runs[index]
            at = max(due, slot_at(self._move_to(due), run.automaton.interval))
            self.run_cycle(run, at)
            heapq.heappush(self._due, (max(run.next_slot, slot_after(at, run.automaton.interval)), index))
        if self.halted and not was_halted and self._on_halt is not None:
            self._on_halt()
        self._move_to(end)

    def run_cycle(self, run: Run, at: int) -> None:
        """Run one cycle of an automaton, which belongs to a component time in ns; a ghost runs none."""
        run_cycle(self.tree, run, at, self._supervision)

    def send(self, name: str, data: object = None) -> None:
        """Send an event to every automaton that is active; raises EventError."""
        self.tree.send(make_event(name, data), self._timeline.now())

    def replace(self, component: Component, apply: Callable[[int], object]) -> None:
        """Continue with another version of the component; `apply` puts its automata into the tree."""
        now = self._timeline.now()
        with self.tree.lock:
            apply(now)
        self.component = component
        self._supervision.turn_to(component)
        self._due = [
            (slot_after(now, run.automaton.interval), index) for index, run in enumerate(self.tree.runs)
        ]
        heapq.heapify(self._due)

    def changes(self, automaton: str) -> list[tuple[float, str]]:
        """Return the states that an automaton has entered, the initial one included, each with its time."""
        return [
            (change.time, change.state)
            for change in self.trace
            if change.automaton == automaton and change.kind is ChangeKind.ENTERED
        ]

    def _sleep(self, seconds: float) -> None:
        self.clock.advance(max(0.0, seconds))

    def _move_to(self, when: int) -> int:
        """Advance the time to `when`; return the new time, which may be later."""
        now = self._timeline.now()
        if now < when:
            self.clock.advance((when - now) / _SECOND)
            now = self._timeline.now()
        return now

    def _refused(self, refusal: Refusal) -> None:
        self.refusal, self._until_retry = refusal, _RETRY
        self.tree.held = True
        self._timeline.pause()

    def _sit_out(self, longest: int) -> int:
        """Let the clock run until the automata may try again; return how long that took in ns."""
        assert self.refusal is not None
        taken = 0
        while taken < longest:
            wait = min(longest - taken, self._until_retry)
            self.clock.advance(wait / _SECOND)
            taken += wait
            self._until_retry -= wait
            if self._until_retry > 0:
                break
            self._until_retry = _RETRY
            if self._commands_accepted(self.refusal.holder):
                self.refusal = None
                self.tree.held = False
                self._timeline.resume()
                break
        return taken

    def _halt(self) -> None:
        self.halted = True


def run(component: Component, seconds: float) -> VirtualRun:
    """Run a component for some seconds of virtual time and return what happened."""
    virtual = VirtualRun(component)
    virtual.advance(seconds)
    return virtual
