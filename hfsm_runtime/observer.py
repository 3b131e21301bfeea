"""What can be seen of automata while they run: for coverage, recordings and whoever else looks on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from .automaton import Event, Transition
    from .tree import ChangeKind, Run

__all__ = ["Observer", "Watcher"]


class Observer(Protocol):
    """Looks on; add one to `Tree.observers` before the start.

    Its methods run on the thread of the automaton, in the middle of a cycle: they must not block, and not
    raise. Times are component time in ns; `at` is that of the cycle.
    """

    def cycle_began(self, run: Run, at: int) -> None:
        """A cycle begins; `run.present` are the events that are present in it."""

    def guard_evaluated(self, run: Run, transition: Transition, value: bool, at: int) -> None:
        """The guard of a transition out of the current state was asked."""

    def fired(self, run: Run, transition: Transition, at: int) -> None:
        """A transition fires: its origin is still the current state, and its exit code has not run."""

    def cycle_ended(self, run: Run, at: int) -> None:
        """A cycle ended, whether it went through or not."""

    def changed(self, now: int, run: Run, kind: ChangeKind) -> None:
        """Tell of a change; called under the lock of the tree."""

    def event_sent(self, event: Event, now: int) -> None:
        """Somebody sent an event; called under the lock of the tree."""

    def code_failed(self, run: Run, error: Exception) -> None:
        """A piece of user code raised an exception."""


class Watcher:
    """An observer that does nothing: override what is of interest."""

    def cycle_began(self, run: Run, at: int) -> None:
        """Do nothing."""

    def guard_evaluated(self, run: Run, transition: Transition, value: bool, at: int) -> None:
        """Do nothing."""

    def fired(self, run: Run, transition: Transition, at: int) -> None:
        """Do nothing."""

    def cycle_ended(self, run: Run, at: int) -> None:
        """Do nothing."""

    def changed(self, now: int, run: Run, kind: ChangeKind) -> None:
        """Do nothing."""

    def event_sent(self, event: Event, now: int) -> None:
        """Do nothing."""

    def code_failed(self, run: Run, error: Exception) -> None:
        """Do nothing."""
