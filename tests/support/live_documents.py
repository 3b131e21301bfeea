"""Documents on threads, by a clock whose threads wake late, and what happened in them."""

from __future__ import annotations

import random
import threading

from codegen.hfsm.document import Document
from hfsm_runtime import Transition
from hfsm_runtime._runtime import Runtime
from hfsm_runtime._timeline import slot_from
from hfsm_runtime.tree import Actor
from tests.support.model_documents import Script, ScriptedDocument
from zenoh_ice import WallClock

__all__ = ["LateClock", "LivePlayer"]


class LateClock(WallClock):
    """Steady wall time; a thread that waits until a time is woken up to `most` s late, at random."""

    def __init__(self, seed: int, most: float) -> None:
        self._random = random.Random(seed)
        self._most = most

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s and a little more; return whether it is set."""
        return super().wait(event, timeout + self._random.uniform(0.0, self._most))


class LivePlayer(ScriptedDocument):
    """A document on threads, and its record, until a thread was so late that a cycle was missed.

    That may be the machine's fault, and the runtime promises nothing then. So may a cycle be that lasts
    longer than the shortest period.
    """

    def __init__(self, document: Document, script: Script, clock: WallClock) -> None:
        super().__init__(document, script.guard, script.events)
        self.runtime = Runtime(self.component, clock)
        self._tree = self.runtime.tree
        self._shortest = min(run.automaton.interval for run in self._tree.actors)
        self._happened: list[tuple[str, int, int]] = []
        self._length: int | None = None
        """How much had happened when the first cycle was missed."""
        self._expected: dict[Actor, int] = {}
        self._began: dict[Actor, tuple[int, int]] = {}
        self._tree.observers.append(self)

    @property
    def states(self) -> set[tuple[int, int]]:
        """The states that were entered, each as the ids of the automaton and the state."""
        return self._all("state")

    @property
    def transitions(self) -> set[tuple[int, int]]:
        """The transitions that fired, each as the ids of the automaton and the transition."""
        return self._all("transition")

    @property
    def events(self) -> int:
        """How much happened until a cycle was missed: states in cycles, and transitions."""
        return len(self._happened[: self._length])

    def cycle_began(self, run: Actor, at: int) -> None:
        super().cycle_began(run, at)
        with self._tree.lock:
            interval = run.automaton.interval
            if at > max(self._expected.get(run, 0), slot_from(run.active_since or 0, interval)):
                self._end_at(len(self._happened))
            self._expected[run] = at + interval
            self._began[run] = self.runtime.component_time.now(), len(self._happened)

    def fired(self, run: Actor, transition: Transition, at: int) -> None:
        self._happened.append(("transition", run.automaton.id, transition.id))

    def cycle_ended(self, run: Actor, at: int) -> None:
        with self._tree.lock:
            began, length = self._began[run]
            if self.runtime.component_time.now() - began >= self._shortest:
                self._end_at(length)
            found = [
                ("state", each.automaton.id, each.current.id) for each in self._tree.actors if each.active
            ]
            self._happened += found

    def _end_at(self, length: int) -> None:
        self._length = length if self._length is None else min(length, self._length)

    def _all(self, kind: str) -> set[tuple[int, int]]:
        found = self._happened[: self._length]
        return {(automaton, item) for each, automaton, item in found if each == kind}
