"""The state of each automaton of a component, and its changes: which are active, ghosts, or waking.

Times are integer nanoseconds of component time.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping

import msgspec

from ._automaton import REFUSED, Arguments, Automaton, Event, State, Transition
from ._automaton_run import CAPACITY, ChangeKind, DropReason, Run, grow, owes
from ._timeline import slot_from
from .errors import UnknownElementError
from .observer import Observer

__all__ = ["ChangeKind", "DropReason", "Replaced", "Run", "Tree", "grow"]


class Replaced(msgspec.Struct, frozen=True):
    """The fate of replaced automata: which are `gone`, and which lost their state."""

    gone: tuple[Run, ...]
    displaced: tuple[tuple[Run, State], ...]


class Tree:
    """The automata of a component at run time.

    `observers` are notified of everything that happens to them. Raises DefinitionError.
    """

    def __init__(self, root: Automaton) -> None:
        self.lock = threading.RLock()
        self.held = False
        """While set no cycle begins, except those of automata that are `stepping`."""
        self.observers: list[Observer] = []
        self._cycle_ended = threading.Condition(self.lock)
        self.runs: tuple[Run, ...] = grow(root)
        """All automata, each before its children."""
        self._by_id = {run.automaton.id: run for run in self.runs}

    @property
    def root(self) -> Run:
        """The automaton that no state owns."""
        return self.runs[0]

    def run(self, id: int) -> Run | None:
        """Return an automaton by its id, or None."""
        return self._by_id.get(id)

    def begin_at(self, automaton: int, state: int) -> None:
        """Let `start` enter a state, and the owners above it, instead of the initial ones.

        Automata that start again later begin in their initial states. Raises UnknownElementError.
        """
        run = self._by_id.get(automaton)
        if run is None:
            known = ", ".join(map(str, self._by_id))
            raise UnknownElementError(f"there is no automaton {automaton} to begin at: there are {known}")
        try:
            first = run.automaton.state(state)
        except KeyError:
            known = ", ".join(f"{each.id} ({each.name})" for each in run.automaton.states)
            what = f"automaton {automaton} has no state {state} to begin at: there are {known}"
            raise UnknownElementError(what) from None
        run.begin_in(first)
        for each in run.chain():
            if each.parent is not None and each.owner is not None:
                each.parent.begin_in(each.owner)

    def start(self, now: int) -> None:
        """Enter the initial states: the timers of all that is active begin to count."""
        with self.lock:
            self._begin(self.root, now)

    def send(self, event: Event, now: int) -> None:
        """Put an event into the queue of every active automaton that has a transition for its name."""
        with self.lock:
            for observer in self.observers:
                observer.event_sent(event, now)
            for run in self.runs:
                if run.active and not run.finished and event.name in run.automaton.events:
                    if len(run.queue) >= CAPACITY:
                        self._drop(run, DropReason.OVERFLOW, now)
                    run.queue.append(event)

    def refuse(self, run: Run, why: str) -> bool:
        """Let the nearest state that waits for `REFUSED`, from an automaton up, hear it before other events.

        Returns false when none waits for it.
        """
        with self.lock:
            waiting = next(filter(_waits_for_refusal, run.chain()), None) if run.on_duty else None
            if waiting is not None:
                waiting.refusal = Event(REFUSED, why)
            return waiting is not None

    def next_event(self, run: Run, now: int) -> Event | None:
        """Return the oldest due event for which a transition out of the current state waits; a refusal first.

        It stays in the queue until it fires a transition or is dropped. Events before it are dropped.
        """
        if run.refusal is not None or not run.due:
            return run.refusal
        with self.lock:
            awaited = {transition.event for transition in run.automaton.outgoing(run.current)}
            while run.due:
                if run.queue[0].name in awaited:
                    return run.queue[0]
                self._drop(run, DropReason.UNHANDLED, now)
        return None

    def take_event(self, run: Run, event: Event, now: int, *, handled: bool) -> None:
        """Remove an event that `next_event` returned: one that is not `handled` is dropped."""
        with self.lock:
            if event is run.refusal:
                run.refusal = None
                run.queue.appendleft(event)
                run.due += 1
            if run.queue and run.queue[0] is event:  # an overflow may have been faster
                if handled:
                    self._dequeue(run)
                else:
                    self._drop(run, DropReason.UNHANDLED, now)

    def begin_cycle(self, run: Run) -> bool:
        """Claim an automaton for a cycle; false for a ghost, and for all while the tree is held.

        The events that have arrived become due, except in a cycle that only continues the last one.
        """
        with self.lock:
            stepping, run.stepping = run.stepping, False
            if not run.active or run.finished or (self.held and not stepping):
                return False
            run.began_wall = time.perf_counter()
            run.in_cycle, run.in_step = True, stepping
            run.claimed = run.activations
            if not run.cut:
                run.due = len(run.queue)
            run.cut = False
            return True

    def end_cycle(self, run: Run) -> None:
        """Release an automaton that `begin_cycle` claimed."""
        with self.lock:
            run.in_cycle = run.in_step = False
            self._cycle_ended.notify_all()

    def decide(self, run: Run, until: int) -> None:
        """Set the next cycle of an automaton to the first after a time: those that come before it may run."""
        interval = run.automaton.interval
        run.next_slot = until - until % interval + interval
        if run.followers:
            run.release_followers()

    def may_go_on(self, run: Run) -> bool:
        """Return whether a running cycle may continue: not of a ghost, and not while the tree is held."""
        return run.on_duty and (run.in_step or not self.held)

    def leave(self, run: Run, now: int) -> bool:
        """Begin to leave the current state: all automata below become ghosts.

        Returns false, and changes nothing, if the automaton itself has become a ghost in the meantime.
        """
        with self.lock:
            if not run.on_duty:
                return False
            for child in run.below:
                self._deactivate(child, now)
            return True

    def wait_for_cycles(self, run: Run, timeout: float) -> list[Run]:
        """Wait until no automaton below the current state is in a cycle; return the ones that still are.

        `timeout` is in s of wall time.
        """
        below = [run for child in run.below for run in (child, *child.descendants())]
        if not below:
            return below
        with self.lock:
            self._cycle_ended.wait_for(lambda: not any(run.in_cycle for run in below), timeout)
            return [run for run in below if run.in_cycle]

    def change(self, run: Run, transition: Transition, now: int) -> bool:
        """Change the state; its timers do not run and the automata below sleep until `enter`.

        Returns false, and changes nothing, in a cycle so late that the automaton is active again.
        """
        with self.lock:
            if run.claimed != run.activations:
                return False
            run.last_transition = transition.id
            self._set(run, run.automaton.state(transition.destination), now)
            return True

    def enter(self, run: Run, now: int) -> None:
        """Start the timers of the current state, whose entry is complete, and wake the automata below it.

        The timers of a ghost start when it is active again.
        """
        with self.lock:
            if run.claimed == run.activations:
                run.owed = False
                if run.active:
                    self._settle(run, now)

    def finish(self, run: Run, now: int) -> None:
        """Mark an automaton as finished."""
        with self.lock:
            if run.on_duty and not run.finished:
                run.finished = True
                self._changed(now, run, ChangeKind.FINISHED)
                self._drop_all(run, DropReason.FINISHED, now)

    def hand_up(self, run: Run, outputs: Mapping[str, object]) -> None:
        """Let the automaton above take these outputs from its next cycle on.

        Nothing changes in a cycle so late that the automaton is active again.
        """
        with self.lock:
            if run.claimed == run.activations:
                run.outputs = outputs

    def take(self, run: Run) -> Arguments:
        """Return the outputs of the automata below the current state, as its `results` expects them."""
        with self.lock:
            below = run.below
            for child in below:
                child.taken = child.outputs
            if len(below) == 1:
                return below[0].outputs
            return {child.automaton.id: child.outputs for child in below}

    def suspend(self, run: Run, *, code_first: bool) -> None:
        """Let the next cycle continue where this one pauses: at the state's code, or at the transitions."""
        with self.lock:
            run.cut, run.code_first = True, code_first

    def wait_for_gap(self, timeout: float) -> bool:
        """Wait, under the lock, for a moment without any cycle, which lasts as long as the lock is kept.

        Returns false after `timeout` s of wall time.
        """
        return self._cycle_ended.wait_for(lambda: not any(run.in_cycle for run in self.runs), timeout)

    def replace(self, grown: tuple[Run, ...], now: int) -> Replaced:
        """Replace the automata while no cycle runs; call it under the lock.

        `grown` are the new ones, as `grow` returns them. A present automaton with the id of a new one
        continues, in the state of the same id, or otherwise of the same name if only one has it; if its state
        is gone, it restarts. The values of guards are forgotten.
        """
        before = self._by_id
        runs = tuple(before.get(run.automaton.id, run) for run in grown)
        staying = set(runs)
        gone = tuple(run for run in self.runs if run not in staying)
        for run in gone:
            self._deactivate(run, now)
        displaced = []
        at = {run.automaton.id: run for run in runs}
        root_active = self.root.active
        for new in grown:
            run = at[new.automaton.id]
            run.parent = at[new.parent.automaton.id] if new.parent else None
            run.owner, run.depth = new.owner, new.depth
            run.children = {
                state: tuple(at[child.automaton.id] for child in children)
                for state, children in new.children.items()
            }
            if run is not new:
                if run.automaton.interval != new.automaton.interval:
                    run.next_slot = slot_from(now, new.automaton.interval)
                left = run.adopt(new.automaton)
                if left is not None:
                    displaced.append((run, left))
        self.runs, self._by_id = runs, at
        restarted = {run for run, _ in displaced}
        for run in runs:
            above = run.parent
            if above is None:
                wanted = root_active
            else:
                wanted = above.awake and run.owner is not None and above.current.id == run.owner.id
            if not wanted:
                self._deactivate(run, now)
            elif not run.active:
                self._begin(run, now)
            elif run in restarted:
                self._begin_outputs(run)
                self._set(run, run.automaton.initial, now)
                if not run.owed:
                    self._settle(run, now)
        return Replaced(gone, tuple(displaced))

    def _begin(self, run: Run, now: int) -> None:
        """Activate an automaton below a state that was entered."""
        if run.active:
            return
        restarts = run.finished or (run.owner is not None and run.owner.restart)
        if run.entered is None or restarts:
            run.finished = False
            run.forced = None
            self._activate(run, now, initial=True)
        else:
            self._activate(run, now)

    def _activate(self, run: Run, now: int, *, initial: bool = False) -> None:
        run.active = True
        run.activated = now
        run.activations += 1
        run.next_slot = max(run.next_slot, slot_from(now, run.automaton.interval))
        if initial:
            run.last_transition = 0
            self._begin_outputs(run)
            first, run.first = run.first, None
            self._set(run, first or run.automaton.initial, now)
        else:
            self._changed(now, run, ChangeKind.RESUMED)
        if run.owed:
            return
        if run.waking:
            self._settle(run, now)
        else:
            run.since = now
            for child in run.below:
                if not run.current.final and not child.active:
                    self._activate(child, now)

    def _settle(self, run: Run, now: int) -> None:
        run.since = now
        run.waking = False
        if not run.current.final:
            for child in run.below:
                self._begin(child, now)

    def _deactivate(self, run: Run, now: int) -> None:
        if not run.active:
            return
        for child in run.below:
            self._deactivate(child, now)
        run.active = run.cut = run.code_first = False
        run.refusal = None
        run.waited = run.active_time(now)
        run.since = None
        run.release_followers()
        self._changed(now, run, ChangeKind.GHOST)
        self._drop_all(run, DropReason.GHOST, now)

    def _drop_all(self, run: Run, reason: DropReason, now: int) -> None:
        while run.queue:
            self._drop(run, reason, now)

    def _drop(self, run: Run, reason: DropReason, now: int) -> None:
        """Drop the oldest event of an automaton."""
        event = self._dequeue(run)
        run.dropped += 1
        run.last_dropped = event, reason, now
        for observer in self.observers:
            observer.event_dropped(run, event, reason)

    @staticmethod
    def _begin_outputs(run: Run) -> None:
        """Let the outputs of an automaton that starts have their defaults, which its first cycle sets."""
        run.outputs = run.automaton.first_outputs()
        run.unset = bool(run.outputs)

    @staticmethod
    def _dequeue(run: Run) -> Event:
        run.due = max(0, run.due - 1)
        return run.queue.popleft()

    def _set(self, run: Run, state: State, now: int) -> None:
        run.refusal = None  # it was for the state that is left
        run.current = state
        run.entered = now
        run.owed = owes(state)
        run.waking = run.unseen = True
        run.cut = run.code_first = False
        run.waited = 0
        run.since = None
        run.guards = {}
        self._changed(now, run, ChangeKind.ENTERED)

    def _changed(self, now: int, run: Run, kind: ChangeKind) -> None:
        for observer in self.observers:
            observer.changed(now, run, kind)


def _waits_for_refusal(run: Run) -> bool:
    """Return whether a transition out of the current state waits for `REFUSED`."""
    return any(transition.event == REFUSED for transition in run.automaton.outgoing(run.current))
