"""The state of each automaton of a component, and its changes: which are active, ghosts, or waking.

Times are integer nanoseconds of component time.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence

import msgspec

from ._actor import CAPACITY, Actor, ChangeKind, DropReason, grow
from ._automaton import REFUSED, Arguments, Automaton, Event, State, Transition
from ._phases import (
    BEGUN,
    ENTERED,
    FINISHED,
    IDLE,
    OUTLIVED,
    PAUSED,
    PAUSED_AT_CODE,
    RUNNING,
    SETTLED,
    STEPPING,
    UNUSED,
    Phase,
    first_phase,
)
from ._timeline import slot_from
from .errors import UnknownElementError
from .observer import Observers

__all__ = ["Actor", "ChangeKind", "DropReason", "Phase", "Replaced", "Tree", "grow"]


class Replaced(msgspec.Struct, frozen=True):
    """The fate of replaced automata: which are `gone`, and which lost their state."""

    gone: tuple[Actor, ...]
    displaced: tuple[tuple[Actor, State], ...]


class Tree:
    """The automata of a component at run time.

    `observers` are notified of everything that happens to them. Raises DefinitionError.
    """

    def __init__(self, root: Automaton) -> None:
        self.lock = threading.RLock()
        self.held = False
        """While set no cycle begins, except those of automata that are `stepping`."""
        self.observers = Observers()
        self._cycle_ended = threading.Condition(self.lock)
        self._waiting = 0
        """The number of threads that wait for the end of a cycle."""
        self.actors: tuple[Actor, ...] = grow(root)
        """All automata, each before its children."""
        self._takers = _takers_of(self.actors)
        """The automata that have a transition for an event, by its name."""
        self._by_id = {actor.automaton.id: actor for actor in self.actors}

    @property
    def root(self) -> Actor:
        """The automaton that no state owns."""
        return self.actors[0]

    def actor(self, id: int) -> Actor | None:
        """Return an automaton by its id, or None."""
        return self._by_id.get(id)

    def begin_at(self, automaton: int, state: int) -> None:
        """Let `start` enter a state, and the owners above it, instead of the initial ones.

        Automata that start again later begin in their initial states. Raises UnknownElementError.
        """
        actor = self._by_id.get(automaton)
        if actor is None:
            known = ", ".join(map(str, self._by_id))
            raise UnknownElementError(f"there is no automaton {automaton} to begin at: there are {known}")
        try:
            first = actor.automaton.state(state)
        except KeyError:
            known = ", ".join(f"{each.id} ({each.name})" for each in actor.automaton.states)
            what = f"automaton {automaton} has no state {state} to begin at: there are {known}"
            raise UnknownElementError(what) from None
        actor.turn_to(first)
        for each in actor.chain():
            if each.parent is not None and each.owner is not None:
                each.parent.turn_to(each.owner)

    def start(self, now: int) -> None:
        """Enter the initial states: the timers of all that is active begin to count."""
        with self.lock:
            self._begin(self.root, now)

    def send(self, event: Event, now: int) -> None:
        """Put an event into the queue of every active automaton that has a transition for its name."""
        with self.lock:
            for event_sent in self.observers.event_sent:
                event_sent(event, now)
            for actor in self._takers.get(event.name, ()):
                if actor.active_since is not None and actor.phase is not FINISHED:
                    if len(actor.events.waiting) >= CAPACITY:
                        self._drop(actor, DropReason.OVERFLOW, now)
                    actor.events.waiting.append(event)

    def send_refusal(self, actor: Actor, why: str) -> bool:
        """Let the nearest state that waits for `REFUSED`, from an automaton up, hear it before other events.

        Returns false when none waits for it, and in a cycle that has outlived its activation.
        """
        with self.lock:
            runs = next(each for each in actor.chain() if each.in_cycle)  # exit code runs in that above
            waiting = next(filter(_waits_for_refusal, actor.chain()), None) if runs.on_duty else None
            if waiting is not None:
                waiting.events.refusal = Event(REFUSED, why)
            return waiting is not None

    def next_event(self, actor: Actor, now: int) -> Event | None:
        """Return the oldest due event for which a transition out of the current state waits; a refusal first.

        It stays in the queue until it fires a transition or is dropped. Events before it are dropped.
        """
        events = actor.events
        if events.refusal is not None or not events.due:
            return events.refusal
        with self.lock:
            awaited = actor.automaton.exits[actor.current.id].events
            while events.due:
                event = events.waiting[0]
                if event.name in awaited:
                    return event
                self._drop(actor, DropReason.UNHANDLED, now)
        return None

    def take_event(self, actor: Actor, event: Event, now: int, *, handled: bool) -> None:
        """Remove an event that `next_event` returned: one that is not `handled` is dropped."""
        events = actor.events
        with self.lock:
            if event is events.refusal:
                events.refusal = None
                events.waiting.appendleft(event)
                events.due += 1
            if events.waiting and events.waiting[0] is event:  # an overflow may have been faster
                if handled:
                    events.pop()
                else:
                    self._drop(actor, DropReason.UNHANDLED, now)

    def begin_cycle(self, actor: Actor) -> bool:
        """Claim an automaton for a cycle; false for a ghost, and for all while the tree is held.

        The events that have arrived become due, except in a cycle that only continues the last one.
        """
        with self.lock:
            stepping, actor.stepping = actor.stepping, False
            if actor.active_since is None or actor.phase is FINISHED or (self.held and not stepping):
                return False
            cycle = actor.cycle
            cycle.began_wall = time.perf_counter()
            cycle.status = STEPPING if stepping else RUNNING
            if actor.phase < PAUSED:
                actor.events.due = len(actor.events.waiting)
            return True

    def skip_cycle(self, actor: Actor, now: int) -> bool:
        """Count a cycle in which nothing happens, and nobody looks; false, if something may happen.

        There is nothing to run of a ghost, either.
        """
        if actor.stepping or actor.events.waiting:
            return False
        if actor.active_since is None or actor.phase is FINISHED:
            return True
        observers, cycle = self.observers, actor.cycle
        if observers.cycle_began or observers.cycle_ended or observers.entered:
            return False
        with self.lock:
            if self.held or cycle.status is not IDLE or not actor.rests(now):
                return False
            actor.phase = SETTLED
            cycle.count += 1
            cycle.last = 0.0
            cycle.last_slot = now
            self.decide(actor, now)
            return True

    def end_cycle(self, actor: Actor) -> None:
        """Release an automaton that `begin_cycle` claimed."""
        with self.lock:
            actor.cycle.status = IDLE
            if self._waiting:
                self._cycle_ended.notify_all()

    def decide(self, actor: Actor, until: int) -> None:
        """Set the next cycle of an automaton to the first after a time: those that come before it may run."""
        interval, cycle = actor.automaton.interval, actor.cycle
        cycle.next_slot = until - until % interval + interval
        if cycle.followers:
            cycle.release_followers()

    def may_go_on(self, actor: Actor) -> bool:
        """Return whether a running cycle may continue: not of a ghost, and not while the tree is held."""
        return actor.on_duty and (not self.held or actor.cycle.status is STEPPING)

    def leave(self, actor: Actor, now: int) -> bool:
        """Begin to leave the current state: all automata below become ghosts.

        Returns false, and changes nothing, if the automaton itself has become a ghost in the meantime.
        """
        if not actor.below:
            return actor.on_duty
        with self.lock:
            if not actor.on_duty:
                return False
            for child in actor.below:
                self._deactivate(child, now)
            return True

    def wait_for_cycles(self, actor: Actor, timeout: float) -> list[Actor]:
        """Wait until no automaton below the current state is in a cycle; return the ones that still are.

        `timeout` is in s of wall time.
        """
        below = [actor for child in actor.below for actor in (child, *child.descendants())]
        if not below:
            return below
        with self.lock:
            self._wait_for_end(below, timeout)
            return [actor for actor in below if actor.in_cycle]

    def change(self, actor: Actor, transition: Transition, now: int) -> bool:
        """Change the state; its timers do not run and the automata below sleep until `enter`.

        Returns false, and changes nothing, in a cycle so late that the automaton is active again.
        """
        with self.lock:
            if actor.cycle.status is OUTLIVED:
                return False
            actor.last_transition = transition.id
            self._set(actor, actor.automaton.state(transition.destination), now)
            return True

    def enter(self, actor: Actor, now: int) -> None:
        """Start the timers of the current state, whose entry is complete, and wake the automata below it.

        The timers of a ghost start when it is active again.
        """
        with self.lock:
            if actor.cycle.status is not OUTLIVED:
                actor.phase = ENTERED
                if actor.active_since is not None:
                    self._run_state(actor, now)

    def reach(self, actor: Actor, phase: Phase) -> None:
        """Note how far the running cycle has come; that of a ghost comes to the end of its entry at most."""
        with self.lock:
            if actor.cycle.status is not OUTLIVED and (phase <= ENTERED or actor.active_since is not None):
                actor.phase = phase

    def finish(self, actor: Actor, now: int) -> None:
        """Mark an automaton as finished."""
        with self.lock:
            if actor.on_duty and not actor.finished:
                self.reach(actor, FINISHED)
                self._changed(now, actor, ChangeKind.FINISHED)
                for finished in self.observers.finished:
                    finished(actor)
                self._drop_all(actor, DropReason.FINISHED, now)

    def hand_up(self, actor: Actor, outputs: Mapping[str, object]) -> None:
        """Let the automaton above take these outputs from its next cycle on.

        Nothing changes in a cycle so late that the automaton is active again.
        """
        with self.lock:
            if actor.cycle.status is not OUTLIVED:
                actor.outputs.latest = outputs

    def outputs_below(self, actor: Actor) -> Arguments:
        """Hand over the outputs of the automata below the current state, as its `results` expects them."""
        with self.lock:
            below = [child.outputs for child in actor.below]
            for outputs in below:
                outputs.handed = outputs.latest
            if len(below) == 1:
                return below[0].latest
            return {child.automaton.id: child.outputs.latest for child in actor.below}

    def wait_for_gap(self, timeout: float) -> bool:
        """Wait, under the lock, for a moment without any cycle, which lasts as long as the lock is kept.

        Returns false after `timeout` s of wall time.
        """
        return self._wait_for_end(self.actors, timeout)

    def _wait_for_end(self, actors: Sequence[Actor], timeout: float) -> bool:
        """Wait, under the lock, until none of some automata is in a cycle; false after `timeout` s."""
        self._waiting += 1
        try:
            return self._cycle_ended.wait_for(lambda: not any(actor.in_cycle for actor in actors), timeout)
        finally:
            self._waiting -= 1

    def replace(self, grown: tuple[Actor, ...], now: int) -> Replaced:
        """Replace the automata while no cycle runs; call it under the lock.

        `grown` are the new ones, as `grow` returns them. A present automaton with the id of a new one
        continues, in the state of the same id, or otherwise of the same name if only one has it; if its state
        is gone, it restarts. The values of guards are forgotten.
        """
        before = self._by_id
        actors = tuple(before.get(actor.automaton.id, actor) for actor in grown)
        staying = set(actors)
        gone = tuple(actor for actor in self.actors if actor not in staying)
        for actor in gone:
            self._deactivate(actor, now)
        displaced = []
        at = {actor.automaton.id: actor for actor in actors}
        root_active = self.root.active
        for new in grown:
            actor = at[new.automaton.id]
            actor.move_below(at[new.parent.automaton.id] if new.parent else None)
            actor.owner = new.owner
            actor.children = {
                state: tuple(at[child.automaton.id] for child in children)
                for state, children in new.children.items()
            }
            if actor is new:
                actor.turn_to(actor.current)
            else:
                if actor.automaton.interval != new.automaton.interval:
                    actor.cycle.next_slot = slot_from(now, new.automaton.interval)
                left = self._adopt(actor, new.automaton)
                if left is not None:
                    displaced.append((actor, left))
        self.actors, self._by_id, self._takers = actors, at, _takers_of(actors)
        restarted = {actor for actor, _ in displaced}
        for actor in actors:
            above = actor.parent
            if above is None:
                wanted = root_active
            else:
                wanted = above.awake and actor.owner is not None and above.current.id == actor.owner.id
            if not wanted:
                self._deactivate(actor, now)
            elif not actor.active:
                self._begin(actor, now)
            elif actor in restarted:
                self._begin_outputs(actor)
                self._set(actor, actor.current, now)
                if actor.phase is ENTERED:
                    self._run_state(actor, now)
        return Replaced(gone, tuple(displaced))

    def _begin(self, actor: Actor, now: int) -> None:
        """Activate an automaton below a state that was entered."""
        if actor.active_since is not None:
            return
        if actor.phase is UNUSED:
            first: State | None = actor.current
        elif actor.phase is FINISHED or (actor.owner is not None and actor.owner.restart):
            first = actor.automaton.initial
        else:
            first = None
        if first is not None:
            actor.forced = None
        self._activate(actor, now, first)

    def _activate(self, actor: Actor, now: int, first: State | None = None) -> None:
        """Let an automaton start in a `first` state, or go on where it was."""
        actor.active_since = now
        cycle = actor.cycle
        if cycle.status is not IDLE:
            cycle.status = OUTLIVED
        cycle.next_slot = max(cycle.next_slot, slot_from(now, actor.automaton.interval))
        if first is None:
            self._changed(now, actor, ChangeKind.RESUMED)
        else:
            actor.last_transition = 0
            self._begin_outputs(actor)
            self._set(actor, first, now)
        if actor.phase >= ENTERED:
            self._run_state(actor, now)

    def _run_state(self, actor: Actor, now: int) -> None:
        """Let the timers of the current state count, and wake the automata below it.

        When it begins, they begin or go on as their owner says; otherwise they all go on.
        """
        actor.since = now
        begins = actor.phase is ENTERED
        if begins:
            actor.phase = BEGUN
        elif actor.phase is PAUSED or actor.phase is PAUSED_AT_CODE:
            actor.phase = SETTLED
        if actor.current.final:
            return
        for child in actor.below:
            if begins:
                self._begin(child, now)
            elif not child.active:
                # A reload may have added it, or taken its state away, while this one was a ghost.
                self._activate(child, now, child.current if child.phase is UNUSED else None)

    def _deactivate(self, actor: Actor, now: int) -> None:
        if actor.active_since is None:
            return
        for child in actor.below:
            self._deactivate(child, now)
        actor.active_since = None
        actor.events.refusal = None
        actor.waited = actor.active_time(now)
        actor.since = None
        if actor.cycle.followers:
            actor.cycle.release_followers()
        self._changed(now, actor, ChangeKind.GHOST)
        if actor.events.waiting:
            self._drop_all(actor, DropReason.GHOST, now)

    def _drop_all(self, actor: Actor, reason: DropReason, now: int) -> None:
        while actor.events.waiting:
            self._drop(actor, reason, now)

    def _drop(self, actor: Actor, reason: DropReason, now: int) -> None:
        """Drop the oldest event of an automaton."""
        event = actor.events.pop()
        actor.events.dropped += 1
        actor.events.last_dropped = event, reason, now
        for event_dropped in self.observers.event_dropped:
            event_dropped(actor, event, reason)

    @staticmethod
    def _begin_outputs(actor: Actor) -> None:
        """Let the outputs of an automaton that starts have their defaults, which its first cycle sets."""
        actor.outputs.unset = bool(actor.automaton.outputs)
        if actor.outputs.unset:
            actor.outputs.latest = actor.automaton.first_outputs()

    def _set(self, actor: Actor, state: State, now: int) -> None:
        actor.events.refusal = None  # it was for the state that is left
        actor.turn_to(state)
        actor.entered = now
        actor.phase = first_phase(state)
        actor.waited = 0
        actor.since = None
        if actor.guards:
            actor.guards = {}
        for changed in self.observers.changed:
            changed(now, actor, ChangeKind.ENTERED)

    @staticmethod
    def _adopt(actor: Actor, automaton: Automaton) -> State | None:
        """Continue as another version of an automaton; return the state that it lost, if any.

        An automaton that lost its state has not entered any state.
        """
        left, former, outputs = actor.current, actor.automaton, actor.outputs
        actor.automaton = automaton
        types = {each.name: each.type for each in former.outputs}
        kept = {each.name for each in automaton.outputs if types.get(each.name) is each.type}
        values = {name: value for name, value in outputs.latest.items() if name in kept}
        outputs.latest = automaton.first_outputs() | values
        forced, known = actor.forced, {transition.id: transition for transition in automaton.transitions}
        actor.forced = known.get(forced.id) if forced else None
        if actor.last_transition not in known:
            actor.last_transition = 0
        actor.guards = {}
        unused = actor.phase is UNUSED
        found = None if unused and left is former.initial else _counterpart(left, automaton)
        actor.turn_to(found or automaton.initial)
        if found is not None and not unused:
            if actor.phase is FINISHED and not found.final:
                actor.phase = SETTLED
            return None
        actor.phase = UNUSED
        actor.last_transition = 0
        actor.waited = 0
        actor.forced = None
        return None if unused else left

    def _changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:
        for changed in self.observers.changed:
            changed(now, actor, kind)


def _takers_of(actors: tuple[Actor, ...]) -> dict[str, list[Actor]]:
    takers: dict[str, list[Actor]] = {}
    for actor in actors:
        for name in actor.automaton.events:
            takers.setdefault(name, []).append(actor)
    return takers


def _waits_for_refusal(actor: Actor) -> bool:
    """Return whether a transition out of the current state waits for `REFUSED`."""
    return any(transition.event == REFUSED for transition in actor.automaton.outgoing(actor.current))


def _counterpart(state: State, automaton: Automaton) -> State | None:
    """Return the counterpart of a state in another version of its automaton."""
    same = [other for other in automaton.states if other.id == state.id]
    same = same or [other for other in automaton.states if other.name == state.name]
    return same[0] if len(same) == 1 else None
