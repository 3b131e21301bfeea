"""Where each automaton of a component is: current states, ghosts, and the active time in each state.

Times are integer nanoseconds of component time, so that nothing is lost by adding them up.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum

from .automaton import Automaton, State, Transition
from .errors import DefinitionError

__all__ = ["ChangeKind", "Run", "Tree"]


class ChangeKind(StrEnum):
    """What happened to an automaton."""

    ENTERED = "entered"
    """It entered a state."""
    GHOST = "ghost"
    """An ancestor left the state above it: it remembers its own."""
    RESUMED = "resumed"
    """It goes on in the state that it remembered."""


@dataclass(eq=False, slots=True)
class Run:
    """An automaton while it runs. What is here changes only through `Tree`, and under its lock."""

    automaton: Automaton
    parent: Run | None
    owner: State | None
    """The state of the parent that owns it."""
    depth: int
    children: dict[int, tuple[Run, ...]] = field(default_factory=dict)
    """The automata below it, by the id of the state that owns them."""
    current: State = field(init=False)
    active: bool = False
    """Whether every ancestor is in the state that owns the chain down to here: if not, it is a ghost."""
    activated: int = 0
    """When it last became active."""
    entered: int | None = None
    """When it entered its current state; None before it was active for the first time."""
    waited: int = 0
    """The active time in the current state up to `since`."""
    since: int | None = None
    """Since when active time counts on; None while it stands still."""
    last_transition: int = 0
    forced: Transition | None = None
    """What is to fire in the next cycle, whatever its guard says."""
    stepping: bool = False
    """Whether one cycle is to run although the tree is held."""
    in_cycle: bool = False
    guards: dict[int, bool] = field(default_factory=dict)
    """The last value of each guard out of the current state."""
    cycles: int = 0
    overruns: int = 0
    last_cycle: float = 0.0
    longest_cycle: float = 0.0

    def __post_init__(self) -> None:
        self.current = self.automaton.initial

    def active_time(self, now: int) -> int:
        """Return the active time since the entry into the current state in ns."""
        return self.waited + (0 if self.since is None else max(0, now - self.since))

    def descendants(self) -> Iterator[Run]:
        """Yield all automata below this one."""
        for children in self.children.values():
            for child in children:
                yield child
                yield from child.descendants()


class Tree:
    """The automata of a component at run time.

    `on_change` is called, under the lock, after every change of state and each time an automaton becomes a
    ghost or is one no longer; it must not block.
    """

    def __init__(self, root: Automaton) -> None:
        self.lock = threading.RLock()
        self.held = False
        """While set no cycle begins, except those of automata that are `stepping`."""
        self.on_change: list[Callable[[int, Run, ChangeKind], None]] = []
        self._cycle_ended = threading.Condition(self.lock)
        self.runs: tuple[Run, ...] = tuple(_grow(root, None, None, 0))
        """All automata, each before its children."""
        self._by_id = {run.automaton.id: run for run in self.runs}
        if len(self._by_id) != len(self.runs):
            raise DefinitionError("two automata have one id")

    @property
    def root(self) -> Run:
        """The automaton that no state owns."""
        return self.runs[0]

    def run(self, id: int) -> Run | None:
        """Return an automaton by its id, or None."""
        return self._by_id.get(id)

    def start(self, now: int) -> None:
        """Enter the initial states: the timers of all that is active begin to count."""
        with self.lock:
            self._activate(self.root, now)

    def begin_cycle(self, run: Run) -> bool:
        """Claim an automaton for a cycle; false for a ghost, and for all while the tree is held."""
        with self.lock:
            stepping, run.stepping = run.stepping, False
            run.in_cycle = run.active and (stepping or not self.held)
            return run.in_cycle

    def end_cycle(self, run: Run) -> None:
        """Give an automaton free that `begin_cycle` claimed."""
        with self.lock:
            run.in_cycle = False
            self._cycle_ended.notify_all()

    def leave(self, run: Run, transition: Transition, now: int) -> bool:
        """Change the state of an automaton; all below the one that it left become ghosts.

        The timers of the new state do not run yet, and the automata below it are ghosts still: that is for
        `enter`. False, and no change, when the automaton has become a ghost itself in the meantime.
        """
        with self.lock:
            if not run.active:
                return False
            for child in run.children.get(run.current.id, ()):
                self._deactivate(child, now)
            run.current = run.automaton.state(transition.destination)
            run.last_transition = transition.id
            run.entered = now
            run.waited = 0
            run.since = None
            run.guards = {}
            self._changed(now, run, ChangeKind.ENTERED)
            return True

    def enter(self, run: Run, now: int) -> None:
        """Start the timers of the state that `leave` brought, and wake the automata below it."""
        with self.lock:
            if run.active:
                run.since = now
                for child in run.children.get(run.current.id, ()):
                    self._activate(child, now)

    def wait_for_cycles(self, state: State, run: Run, timeout: float) -> list[Run]:
        """Wait until no automaton below a state of `run` is in a cycle; return those that still are.

        `timeout` is in s of wall time.
        """
        children = run.children.get(state.id, ())
        below = [run for child in children for run in (child, *child.descendants())]
        with self.lock:
            self._cycle_ended.wait_for(lambda: not any(run.in_cycle for run in below), timeout)
            return [run for run in below if run.in_cycle]

    def _activate(self, run: Run, now: int) -> None:
        if run.active:
            return
        run.active = True
        run.activated = now
        run.since = now
        if run.entered is None:
            run.entered = now
            self._changed(now, run, ChangeKind.ENTERED)
        else:
            self._changed(now, run, ChangeKind.RESUMED)
        for child in run.children.get(run.current.id, ()):
            self._activate(child, now)

    def _deactivate(self, run: Run, now: int) -> None:
        if not run.active:
            return
        for child in run.children.get(run.current.id, ()):
            self._deactivate(child, now)
        run.active = False
        run.waited = run.active_time(now)
        run.since = None
        self._changed(now, run, ChangeKind.GHOST)

    def _changed(self, now: int, run: Run, kind: ChangeKind) -> None:
        for notify in self.on_change:
            notify(now, run, kind)


def _grow(automaton: Automaton, parent: Run | None, owner: State | None, depth: int) -> Iterator[Run]:
    run = Run(automaton, parent, owner, depth)
    yield run
    for state in automaton.states:
        below: list[Run] = []
        for child in state.children:
            grown = list(_grow(child, run, state, depth + 1))
            below.append(grown[0])
            yield from grown
        if below:
            run.children[state.id] = tuple(below)
