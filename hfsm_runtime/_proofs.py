"""Look whether what the proofs about a document rely on is so, while its component runs.

A component keeps it as rows, which `codegen/hfsm/model_checker/_relied.py` explains. What is not so is an
error, which is told once for each place and ends nothing. It is not told when something was done that no
proof allows for: an exception in code, a pause, a forced transition, a breakpoint, a reload, values that
somebody set. Events alone are looked at nevertheless, until somebody sets what the code reads.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial
from inspect import isfunction
from itertools import pairwise
from threading import Event as Flag
from typing import Any, Final

from codegen.logic import Conjunction, Form, predicate, satisfy

from ._automaton import Transition
from ._order import LEAST_WAIT
from ._supervision import Supervision
from .component import Component, source_of
from .observer import Observer
from .source_map import locate_frame, place_of
from .tree import Actor, ChangeKind, Tree

_Place = tuple[int, int]
"""The ids of an automaton and of a state or a transition of it."""


class Proofs(Observer):
    """What the proofs about a component rely on; `told` is what is not so.

    Automata run one at a time if they are `ordered`, otherwise side by side.
    """

    def __init__(
        self, component: Component, tree: Tree, supervision: Supervision, ended: Flag, *, ordered: bool
    ) -> None:
        self._component: Final = component
        self._tree: Final = tree
        self._supervision: Final = supervision
        self._is_doubtful = self._is_void = False
        self._places: Final = set[Hashable]()
        self._compared: Final = dict[Hashable, bool]()
        self.told: Final[list[str]] = []
        self._events: Final = set[str]()
        self._sends: Final = dict[_Place, frozenset[str]]()
        self._guards: Final = dict[_Place, Conjunction]()
        self._never: Final = {"unentered": set[_Place](), "unfired": set[_Place]()}
        properties: list[_Property] = []
        for key, *values in component._hfsm_proofs:
            kind, _, name = key.partition(" ")
            match kind:
                case "event":
                    self._events.add(name)
                case "property":
                    properties.append(_Property(tree, name, values))
                case _:
                    automaton, _, number = name.partition(".")
                    place = int(automaton), int(number)
                    if kind == "sends":
                        self._sends[place] = frozenset(values)
                    elif kind == "guard":
                        self._guards[place] = tuple(zip(values[::2], values[1::2], strict=True))
                    else:
                        self._never[kind].add(place)
        names = ", ".join(f"`{each.name}`" for each in properties)
        self._proof: Final = (
            f"the proof of {names}" if names else f"what is proved of {component._hfsm_document}"
        )
        complete = {place for place, guards in self._by_state().items() if satisfy((), guards) is None}
        if self._guards or any(self._never.values()):
            tree.observers.append(self)
        if complete:
            tree.observers.append(_CompleteGuards(self, complete))
        if properties:
            tree.observers.append(_Properties(self, tree, properties, ended, ordered=ordered))

    def doubt(self) -> None:
        """Tell nothing more but of events: something was done that proofs do not allow for."""
        self._is_doubtful = True

    def void(self) -> None:
        """Tell nothing more: the code was given values that it does not give itself."""
        self._is_void = self._is_doubtful = True

    def arrives(self, event: str) -> None:
        """Note an event from outside; only code is to send some."""
        if event in self._events:
            self.doubt()

    def sent(self, event: str, actor: Actor | None) -> None:
        """Look at an event that code is about to send, in the cycle of an automaton or outside of cycles."""
        if event not in self._events or self._is_void:
            return
        with self._tree.lock:  # so that the automaton stays where it is
            if actor is not None and actor.on_duty:
                place = actor.automaton.id, actor.current.id
                if event in self._sends.get(place, ()):
                    return
                who = f"the state `{actor.current.name}`"
            elif any(event in sent for sent in self._sends.values()):
                return
            else:
                place, who = (0, 0), "code outside of cycles"
        where = locate_frame(sys._getframe(1), source_of(self._component))
        what = f"{who} sent `{event}`, and the checks found no code there that does"
        self._tell(actor, (*place, event), what, where)

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Look at a state that is entered."""
        place = actor.automaton.id, actor.current.id
        if kind is ChangeKind.ENTERED and place in self._never["unentered"]:
            what = f"the state `{actor.current.name}` was entered, which the checks call impossible"
            self.tell(actor, ("state", place), what)

    def fired(self, actor: Actor, transition: Transition, at: int) -> None:
        """Look at a transition that fires, and at the guards that let it."""
        place = actor.automaton.id, transition.id
        if place in self._never["unfired"]:
            what = f"{_name(transition)} fired, which the checks call impossible"
            self.tell(actor, ("transition", place), what, place_of(transition.guard or transition.code))
        if place in self._guards:
            self.compare(actor, at, transition)

    def compare(self, actor: Actor, at: int, last: Transition | None = None) -> None:
        """Look whether the guards of a cycle contradict each other, up to the `last` that was evaluated."""
        automaton, seen = actor.automaton.id, list[tuple[Transition, bool]]()
        for each in actor.automaton.outgoing(actor.current):
            value, when = actor.guards.get(each.id, (False, -1))
            if when == at and (automaton, each.id) in self._guards:
                seen.append((each, value))
            if each is last:
                break
        key = automaton, tuple((each.id, value) for each, value in seen)
        if key not in self._compared:
            held = (self._guards[automaton, each.id] for each, value in seen if value)
            others = [self._guards[automaton, each.id] for each, value in seen if not value]
            wanted = tuple(literal for conjunction in held for literal in conjunction)
            self._compared[key] = satisfy(wanted, others) is not None
        if not self._compared[key]:
            values = ", ".join(f"{_name(each)} {value}" for each, value in seen)
            what = (
                f"guards out of the state `{actor.current.name}` contradict each other in one cycle: {values}"
            )
            self.tell(actor, ("guards", automaton, actor.current.id), what, place_of(seen[-1][0].guard))

    def tell(self, actor: Actor, place: Hashable, what: str, where: str = "", proof: str = "") -> None:
        """Tell what is not so, unless something was done that no proof allows for."""
        if not (self._is_doubtful or self._supervision.raised):
            self._tell(actor, place, what, where, proof)

    def _tell(self, actor: Actor | None, place: Hashable, what: str, where: str, proof: str = "") -> None:
        if place in self._places or _is_patched(self._component):
            return
        self._places.add(place)
        message = f"{proof or self._proof} is wrong here: {what}"
        self.told.append(f"{message}\n  at {where}" if where else message)
        self._supervision.tell(actor or self._tree.root, where, message)
        if actor is not None:
            for proof_failed in self._tree.observers.proof_failed:
                proof_failed(actor, message)

    def _by_state(self) -> dict[_Place, list[Conjunction]]:
        found: dict[_Place, list[Conjunction]] = {}
        for actor in self._tree.actors:
            for each in actor.automaton.transitions:
                conjunction = self._guards.get((actor.automaton.id, each.id))
                if conjunction is not None:
                    found.setdefault((actor.automaton.id, each.origin), []).append(conjunction)
        return found


class _CompleteGuards(Observer):
    """Look at states in which one of the guards always holds: in the cycles in which none does."""

    def __init__(self, proofs: Proofs, states: set[_Place]) -> None:
        self._proofs: Final = proofs
        self._states: Final = states

    def cycle_ended(self, actor: Actor, at: int) -> None:
        """Compare the guards: a transition that fired has cleared them."""
        if (actor.automaton.id, actor.current.id) in self._states:
            self._proofs.compare(actor, at)


class _Property:
    """A property that is proved, and the automata that decide it; `seen` if it is over, or has come true."""

    def __init__(self, tree: Tree, name: str, row: Sequence[Any]) -> None:
        kind, within, is_timed, decided_by, form = row
        actors: Final = {each.automaton.id: each for each in tree.actors}
        self.name: Final = name
        self.kind: Final[str] = kind
        self.within: Final[float] = within or math.inf
        self.is_timed: Final[bool] = is_timed
        self.automata: Final = sorted((actors[each] for each in decided_by), key=lambda each: each.depth)
        self.is_chain: Final = all(low.parent is high for high, low in pairwise(self.automata))
        self.holds: Final[Callable[[None], bool]] = predicate(form, partial(_look_of, actors))
        self.seen = False


def _look_of(actors: Mapping[int, Actor], form: Form) -> Callable[[None], bool]:
    """Return the function of a smallest part of an expression."""
    kind, *parts = form
    if kind == "in":
        wanted = [(actors[automaton], state) for automaton, state in parts]
        return lambda _: any(actor.active and actor.current.id == state for actor, state in wanted)
    actor = actors[parts[0]]
    return (lambda _: actor.finished) if kind == "finished" else (lambda _: actor.active)


class _Properties(Observer):
    """Look at properties at the start and the end of cycles, while no other cycle changes what they name.

    Where cycles overlap, only those are looked at whose automata are one below the other.
    """

    def __init__(
        self, proofs: Proofs, tree: Tree, properties: list[_Property], ended: Flag, *, ordered: bool
    ) -> None:
        self._proofs: Final = proofs
        self._tree: Final = tree
        self._properties: Final = [each for each in properties if ordered or each.is_chain]
        self._ended: Final = ended
        self._ordered: Final = ordered
        self._is_new = self._is_late = False
        """Whether something has changed since, and whether cycles were not where proofs have them."""
        self._deadline = 0.0

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Note what has come true, if only for a moment."""
        self._is_new = True
        for each in self._properties:
            each.seen |= each.kind == "eventually" and each.holds(None)

    def cycle_began(self, actor: Actor, at: int) -> None:
        """Look, and note that cycles were missed."""
        self._is_late |= at > max(actor.last_slot, actor.activated) + actor.automaton.interval
        self._look(actor, at)

    def cycle_ended(self, actor: Actor, at: int) -> None:
        """Look, and note that it was long, or that its entry was cut."""
        self._is_late |= actor.overruns > 0 or (not self._ordered and actor.last_cycle >= LEAST_WAIT / 1e9)
        if actor.owed:
            self._properties.clear()
        self._look(actor, at)

    def _look(self, actor: Actor, at: int) -> None:
        if self._ended.is_set() or not (self._is_new or at > self._deadline):
            return
        with self._tree.lock:
            self._is_new = False
            for each in self._properties:
                self._look_at(each, actor, at)
            waiting = (
                each.within for each in self._properties if each.kind == "eventually" and not each.seen
            )
            self._deadline = min(waiting, default=math.inf)

    def _look_at(self, stated: _Property, actor: Actor, at: int) -> None:
        others = [each for each in stated.automata if each is not actor]
        if stated.seen:
            return
        if stated.kind == "eventually":
            wrong = stated.seen = at > stated.within
        elif any(each.in_cycle for each in others):
            self._is_new = True  # it is looked at when they have ended
            return
        else:
            wrong = at <= stated.within and stated.holds(None) is (stated.kind == "never")
        self._is_late |= not self._ordered and any(_is_late(each, actor, at) for each in others)
        if wrong and not (stated.is_timed and self._is_late):
            what = f"it does not hold at {at / 1e9:g} s, in {', '.join(self._tree.root.paths())}"
            self._proofs.tell(actor, ("property", stated.name), what, proof=f"the proof of `{stated.name}`")


def _is_late(other: Actor, actor: Actor, at: int) -> bool:
    """Return whether a cycle of another automaton should have come before that of an automaton."""
    if not other.active or other.finished or not other.may_change(at):
        return False
    return other.next_slot < at or (other.next_slot == at and other.depth < actor.depth)


def _is_patched(component: Component) -> bool:
    """Return whether functions of the document are replaced, as by a test."""
    return any(isfunction(getattr(type(component), name, None)) for name in vars(component))


def _name(transition: Transition) -> str:
    return f"`{transition.name}`" if transition.name else f"transition {transition.id}"
