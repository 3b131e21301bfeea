"""Check whether what the proofs about a document rely on is so, while its component runs.

A component keeps it: `codegen.logic.Relied`. What is not so is reported once for each place, an error that
ends nothing. Nothing is reported after what no proof allows for: an exception in code, a pause, a forced
transition, a reload, set values. Events alone are checked nevertheless, until what code may read is set.
"""

from __future__ import annotations

import math
import sys
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass
from inspect import isfunction
from itertools import pairwise, takewhile
from threading import Event as Flag
from typing import Final

from codegen import logic

from ._automaton import Transition
from ._supervision import Supervision
from .component import Component, source_of
from .errors import DefinitionError
from .observer import Observer
from .places import locate_frame
from .tree import Actor, ChangeKind, Tree

_Place = tuple[int, int]
"""The ids of an automaton and of a state or a transition of it."""


class Proofs(Observer):
    """A check of all that the proofs about a component rely on; `reported` says what was not so.

    Automata run one at a time if they are `ordered`, otherwise side by side.
    """

    def __init__(
        self, component: Component, tree: Tree, supervision: Supervision, ended: Flag, *, ordered: bool
    ) -> None:
        self._component: Final = component
        self._tree: Final = tree
        self._supervision: Final = supervision
        self.now: Final = supervision.now
        self._is_doubtful = self._is_void = False
        self._places: Final = set[Hashable]()
        self._consistent: Final = set[Hashable]()
        """States, with guards evaluated there and what fired: those that do not contradict each other."""
        self.reported: Final[list[str]] = []

        self._sent: Final = dict[str, tuple[_Place, ...]]()
        """The states that send an event."""
        self._guards: Final = defaultdict[_Place, dict[int, logic.Conjunction]](dict)
        """The guards out of a state, by their transitions."""
        self._links: Final = defaultdict[_Place, list[logic.Conjunction]](list)
        """What no values of their atoms make true."""
        self._unentered: Final = set[_Place]()
        self._unfired: Final = set[_Place]()
        try:
            relied = [logic.from_row(row) for row in component._hfsm_proofs]
        except (KeyError, TypeError):
            raise DefinitionError("another version generated this component: generate it again") from None
        for each in relied:
            self._keep(each)

        properties = [_Property(tree, each) for each in relied if isinstance(each, logic.Property)]
        names = ", ".join(f"`{each.stated.name}`" for each in properties)
        self._proof: Final = (
            f"the proof of {names}" if names else f"what is proved of {component._hfsm_document}"
        )
        self._has_to_end: Final = any(each.stated.kind == "eventually" for each in properties)

        if self._guards or self._unentered or self._unfired:
            tree.observers.append(self)
        complete = {place for place in self._guards if self._contradict(place, (), self._guards[place])}
        if complete:
            tree.observers.append(_CompleteGuards(self, complete))
        checked = [each for each in properties if ordered or (each.is_chain and not each.stated.is_timed)]
        self._properties: Final = _Properties(self, tree, checked, ended)
        if checked:
            tree.observers.append(self._properties)

    def _keep(self, relied: logic.Relied) -> None:
        match relied:
            case logic.Sent(event, states):
                self._sent[event] = states
            case logic.Guard(automaton, state, transition, needs):
                self._guards[automaton, state][transition] = needs
            case logic.Link(automaton, state, values):
                self._links[automaton, state].append(values)
            case logic.Unentered(automaton, state):
                self._unentered.add((automaton, state))
            case logic.Unfired(automaton, transition):
                self._unfired.add((automaton, transition))

    def start(self) -> None:
        """Check the properties in the initial states."""
        self._properties.check(self._tree.root, 0)

    def doubt(self, *, values: bool = False) -> None:
        """Report no more, but events: something was done that proofs do not allow for.

        Nor events if `values` were set, which code may send.
        """
        self._is_doubtful = True
        self._is_void |= values

    def arrives(self, event: str) -> None:
        """Note an event from outside; only code is to send some."""
        if event in self._sent:
            self.doubt()

    def sent(self, event: str, actor: Actor | None) -> None:
        """Check an event that code is about to send, in the cycle of an automaton or outside of cycles."""
        if event not in self._sent or self._is_void:
            return
        with self._tree.lock:  # so that the automaton stays where it is
            if actor is not None and actor.on_duty:
                place, who = (actor.automaton.id, actor.current.id), f"the state `{actor.current.name}`"
                is_known = place in self._sent[event]
            else:
                place, who = (0, 0), "code outside of cycles"
                is_known = bool(self._sent[event])
        if not is_known:
            where = locate_frame(sys._getframe(1), source_of(self._component))
            what = f"{who} sent `{event}`, and the checks found no code there that does"
            self._report(actor, (*place, event), what, where)

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Check a state that is entered."""
        place = actor.automaton.id, actor.current.id
        if place in self._unentered and kind is ChangeKind.ENTERED:
            what = f"the state `{actor.current.name}` was entered, which the checks call impossible"
            self.report(actor, ("unentered", *place), what)

    def fired(self, actor: Actor, transition: Transition, at: int) -> None:
        """Check a transition that fires, and at the guards that let it."""
        place = actor.automaton.id, transition.id
        if place in self._unfired:
            what = f"{_name(transition)} fired, which the checks call impossible"
            self.report(actor, ("unfired", *place), what)
        self.compare(actor, at, transition)

    def compare(self, actor: Actor, at: int, last: Transition | None = None) -> None:
        """Check whether guards of a cycle contradict each other: none held, or the `last` one alone.

        Those that never do, in whichever cycle they are evaluated, are checked once.
        """
        place = actor.automaton.id, actor.current.id
        key = *place, last and last.id, *actor.guards
        if len(actor.guards) < 2 or key in self._consistent:
            return
        guards = self._guards.get(place, {})
        held = guards.get(last.id, ()) if last else ()
        before = takewhile(lambda each: each is not last, actor.automaton.outgoing(actor.current))
        failed = [each for each in before if each.id in guards and each.id in actor.guards]
        if not self._contradict(place, held, (each.id for each in failed)):
            self._consistent.add(key)
            return
        failed = [each for each in failed if actor.guards[each.id][1] == at]
        if self._contradict(place, held, (each.id for each in failed)):
            values = [f"{_name(each)} false" for each in failed] + ([f"{_name(last)} true"] if last else [])
            what = f"guards out of the state `{actor.current.name}` contradict each other in one cycle"
            self.report(actor, place, f"{what}: {', '.join(values)}")

    def _contradict(self, place: _Place, held: logic.Conjunction, failed: Iterable[int]) -> bool:
        """Return whether guards out of a state can not be so: one that held, and those that did not."""
        refused = [self._guards[place][each] for each in failed]
        return logic.satisfy(held, [*refused, *self._links.get(place, ())]) is None

    def hangs(self, actor: Actor, where: str) -> None:
        """Report a cycle that does not end, if what is proved to come needs all cycles to."""
        if self._has_to_end and not (self._is_doubtful or self._supervision.raised):
            what = f"the cycle of {actor.automaton.name} in the state `{actor.current.name}` does not end"
            self._report(actor, ("hangs", actor.automaton.id), what, where)

    def report(self, actor: Actor, place: Hashable, what: str) -> None:
        """Report what is not so, unless something was done that no proof allows for."""
        if not (self._is_doubtful or self._supervision.raised):
            self._report(actor, place, what)

    def _report(self, actor: Actor | None, place: Hashable, what: str, where: str = "") -> None:
        if place in self._places or _is_patched(self._component):
            return
        self._places.add(place)
        message = f"{self._proof} is wrong here: {what}"
        self.reported.append(f"{message}\n  at {where}" if where else message)
        self._supervision.report(actor or self._tree.root, where, message)
        for proof_failed in self._tree.observers.proof_failed:
            proof_failed(actor, message)


class _CompleteGuards(Observer):
    """Check states in which one of the guards always holds: in the cycles in which none does."""

    def __init__(self, proofs: Proofs, states: set[_Place]) -> None:
        self._proofs: Final = proofs
        self._states: Final = states

    def cycle_ended(self, actor: Actor, at: int) -> None:
        """Compare the guards: a transition that fired has cleared them."""
        if actor.guards and (actor.automaton.id, actor.current.id) in self._states:
            self._proofs.compare(actor, at)


@dataclass(eq=False)
class _Property:
    """A property that is proved, and the automata that decide it.

    It is `seen` if an `eventually` has come true, or was not in time.
    """

    tree: Tree
    stated: logic.Property
    seen: bool = False

    def __post_init__(self) -> None:
        self.within = self.stated.within or math.inf
        self._actors = {each.automaton.id: each for each in self.tree.actors}
        self.automata = sorted(map(self._actors.__getitem__, self.stated.decided_by), key=lambda a: a.depth)
        self.is_chain = all(low.parent is high for high, low in pairwise(self.automata))
        self.holds: Callable[[None], bool] = logic.predicate(self.stated.form, self._leaf)

    def _leaf(self, form: logic.Form) -> Callable[[None], bool]:
        kind, *parts = form
        if kind == "in":
            wanted = [(self._actors[automaton], state) for automaton, state in parts]
            return lambda _: any(actor.active and actor.current.id == state for actor, state in wanted)
        actor = self._actors[parts[0]]
        return (lambda _: actor.finished) if kind == "finished" else (lambda _: actor.active)


class _Properties(Observer):
    """Check properties at the start and the end of cycles, while no other cycle changes what they name."""

    def __init__(self, proofs: Proofs, tree: Tree, properties: list[_Property], ended: Flag) -> None:
        self._proofs: Final = proofs
        self._tree: Final = tree
        self._properties: Final = properties
        self._ended: Final = ended
        self._is_late = False
        """True once cycles were missed."""
        self._next_check = -1.0
        """The time from which the next cycle checks them."""

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Note what has come true, if only for a moment."""
        self._next_check = -1.0
        for each in self._properties:
            if each.stated.kind == "eventually":
                each.seen = each.seen or each.holds(None)

    def fired(self, actor: Actor, transition: Transition, at: int) -> None:  # noqa: ARG002
        """Note that it fires later than it might have."""
        self._is_late |= at > max(actor.cycle.last_slot, actor.active_since or 0) + actor.automaton.interval

    def cycle_ended(self, actor: Actor, at: int) -> None:
        """Check after a change; not after an entry that was cut short."""
        if at > self._next_check:
            if actor.owed:
                self._properties.clear()
            self.check(actor, at)

    def check(self, actor: Actor, at: int) -> None:
        """Check the properties, in the cycle of an automaton."""
        if self._ended.is_set():
            return
        with self._tree.lock:
            self._is_late |= any(each.cycle.overruns for each in self._tree.actors)
            self._next_check = math.inf
            for each in self._properties:
                if not (self._is_late and each.stated.is_timed):
                    self._check_one(each, actor, at)

    def _check_one(self, checked: _Property, actor: Actor, at: int) -> None:
        name, kind, *_ = checked.stated
        if kind == "eventually":
            is_wrong = not checked.seen and at > checked.within
            checked.seen |= is_wrong
            if not checked.seen:
                self._next_check = min(self._next_check, checked.within)
        elif any(each.in_cycle for each in checked.automata if each is not actor):
            self._next_check = -1.0  # when they have ended
            return
        else:
            is_in_time = max(at, self._proofs.now()) <= checked.within  # a cycle may end long after its time
            is_wrong = is_in_time and checked.holds(None) is (kind == "never")
        if is_wrong:
            where = ", ".join(self._tree.root.paths())
            what = f"`{name}` does not hold at {at / 1e9:g} s, in {where}"
            self._proofs.report(actor, ("property", name), what)


def _is_patched(component: Component) -> bool:
    """Return whether functions of the document are replaced, as by a test."""
    return any(isfunction(getattr(type(component), name, None)) for name in vars(component))


def _name(transition: Transition) -> str:
    return f"`{transition.name}`" if transition.name else f"transition {transition.id}"
