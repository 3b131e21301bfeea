"""The hook of the core: observers of running automata, which may ask for a pause."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from ._actor import Actor, ChangeKind, DropReason
from ._automaton import Event, Transition


class Observer:
    """An observer that does nothing: override its methods, and add it to `Tree.observers`.

    The methods run on the thread of the automaton, within a cycle: they must not block, and not
    raise. Times are component time in ns; `at` is that of the cycle.
    """

    def cycle_began(self, actor: Actor, at: int) -> None:
        """A cycle begins, in which the first `due` of the events that are `waiting` may fire transitions."""

    def guard_evaluated(self, actor: Actor, transition: Transition, value: bool, at: int) -> None:
        """The guard of a transition out of the current state was evaluated."""

    def fired(self, actor: Actor, transition: Transition, at: int) -> None:
        """A transition fires: its origin is still the current state, and its exit code has not run."""

    def entered(self, actor: Actor, transition: Transition | None) -> bool:  # noqa: ARG002
        """Return whether to pause: a state was entered, by a transition or as the initial one.

        Its entry is complete and its code has not run. If any observer pauses, the automaton continues from
        here in its next cycle.
        """
        return False

    def cycle_ended(self, actor: Actor, at: int) -> None:
        """A cycle ended, whether it went through or not."""

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:
        """An automaton entered a state, became a ghost, resumed or finished; called under the tree's lock."""

    def finished(self, actor: Actor) -> None:
        """An automaton has finished, as `changed` says, too; called under the tree's lock."""

    def event_sent(self, event: Event, now: int) -> None:
        """An event was sent; called under the tree's lock."""

    def event_dropped(self, actor: Actor, event: Event, reason: DropReason) -> None:
        """An event left the queue of an automaton and fired nothing; called under the tree's lock."""

    def code_failed(self, actor: Actor, error: Exception) -> None:
        """A piece of user code raised an exception."""

    def proof_failed(self, actor: Actor | None, message: str) -> None:
        """What a proof relies on is not so, in a cycle or elsewhere; perhaps called under the tree's lock."""


class Observers:
    """The observers of a tree, as the methods that override each hook: no others are called."""

    if TYPE_CHECKING:

        def __getattr__(self, hook: str) -> tuple[Callable[..., Any], ...]: ...

    def __init__(self) -> None:
        vars(self).update(dict.fromkeys(_HOOKS, ()))

    def append(self, observer: Observer) -> None:
        """Notify an observer, too, after those so far."""
        for hook, empty in _HOOKS.items():
            if getattr(type(observer), hook) is not empty:
                setattr(self, hook, (*getattr(self, hook), getattr(observer, hook)))


_HOOKS: Final = {name: method for name, method in vars(Observer).items() if not name.startswith("_")}
