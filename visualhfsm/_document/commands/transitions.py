"""Commands for transitions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, Final, Literal

from codegen.hfsm.document import Automaton, Document, Transition
from codegen.messages import NO_MESSAGE, Message

from .. import nodes
from ..geometry import with_default_handles
from .base import AutomatonCommand, Id, Index, Language, made_up

_DEFAULT_TIME: Final = "1000"  # ms

TransitionType = Literal["time", "condition", "event", "finished"]


class AddTransition(AutomatonCommand, frozen=True, kw_only=True):
    """Add a transition between two states, or from one to itself; its handle gets a default place."""

    origin: Id
    destination: Id
    type: TransitionType = "condition"
    name: str = ""
    x: float | None = None
    y: float | None = None
    language: Language = ""

    def change(self, automaton: Automaton) -> Automaton:
        number = next(nodes.transition_ids(automaton))
        transition = Transition(
            id=number,
            name=nodes.checked(self.name, Message("the name"))
            or made_up(Message("transition {number}", number=number), self.language),
            origin=nodes.find_state(automaton, self.origin).id,
            destination=nodes.find_state(automaton, self.destination).id,
            type=self.type,
            x=nodes.coordinate(self.x or 0.0),
            y=nodes.coordinate(self.y or 0.0),
        )
        drawn = replace(automaton, transitions=(*automaton.transitions, transition))
        is_placed = self.x is not None and self.y is not None
        return drawn if is_placed else with_default_handles(drawn, frozenset((number,)))

    def title(self, document: Document) -> Message:
        automaton = nodes.find_automaton(document, self.automaton)
        origin, destination = (
            nodes.find_state(automaton, number) for number in (self.origin, self.destination)
        )
        return Message(
            "Add a transition from {origin} to {target}",
            origin=nodes.label(origin),
            target=nodes.label(destination),
        )


class _TransitionCommand(AutomatonCommand, frozen=True, kw_only=True):
    """A change of one transition; it sets the command's fields unless `changed_transition` is overridden."""

    titled: ClassVar[Message] = NO_MESSAGE
    transition: Id

    def changed_transition(self, transition: Transition) -> Transition:
        return nodes.changed(transition, **self.own_fields(_TransitionCommand))

    def change(self, automaton: Automaton) -> Automaton:
        former = nodes.find_transition(automaton, self.transition)
        new = self.changed_transition(former)
        return nodes.changed(automaton, transitions=nodes.swapped(automaton.transitions, former, new))

    def title(self, document: Document) -> Message:
        return Message("{what} {label}", what=self.titled, label=self.label(document))

    def label(self, document: Document) -> Message:
        return nodes.label(
            nodes.find_transition(nodes.find_automaton(document, self.automaton), self.transition)
        )


class RenameTransition(_TransitionCommand, frozen=True, kw_only=True):
    """Rename a transition."""

    typed = ("name",)
    titled = Message("Rename")
    name: str


class RetargetTransition(_TransitionCommand, frozen=True, kw_only=True):
    """Make a transition leave or enter another state; its handle moves to its default place."""

    origin: Id | None = None
    destination: Id | None = None

    def change(self, automaton: Automaton) -> Automaton:
        former = nodes.find_transition(automaton, self.transition)
        origin = former.origin if self.origin is None else nodes.find_state(automaton, self.origin).id
        destination = (
            former.destination
            if self.destination is None
            else nodes.find_state(automaton, self.destination).id
        )
        if (origin, destination) == (former.origin, former.destination):
            return automaton
        new = nodes.changed(former, origin=origin, destination=destination)
        led = replace(automaton, transitions=nodes.swapped(automaton.transitions, former, new))
        return with_default_handles(led, frozenset((former.id,)))

    def title(self, document: Document) -> Message:
        automaton = nodes.find_automaton(document, self.automaton)
        if self.destination is not None:
            return Message(
                "Lead {label} to {state}",
                label=self.label(document),
                state=nodes.label(nodes.find_state(automaton, self.destination)),
            )
        if self.origin is not None:
            return Message(
                "Lead {label} from {state}",
                label=self.label(document),
                state=nodes.label(nodes.find_state(automaton, self.origin)),
            )
        return Message("Lead {label} elsewhere", label=self.label(document))


_TYPES: Final[Mapping[TransitionType, Message]] = {
    "condition": Message("condition"),
    "time": Message("time"),
    "event": Message("event"),
    "finished": Message("finished"),
}


class SetTransitionType(_TransitionCommand, frozen=True, kw_only=True):
    """Set the type of a transition, and its `trigger` unless that is kept.

    A condition becomes the guard of the new type, and a guard the condition, so that no code is lost. A new
    time is one second.
    """

    type: TransitionType
    trigger: str | None = None

    def changed_transition(self, transition: Transition) -> Transition:
        former, guard = transition.trigger.text, transition.guard.text
        trigger = former
        if self.type != transition.type:
            if transition.type == "condition" and not guard.strip():
                trigger, guard = "", former
            elif self.type == "condition" and guard.strip():
                trigger, guard = guard, ""
        if self.type == "finished":
            trigger = ""
        elif self.type == "time" and not trigger.strip():
            trigger = _DEFAULT_TIME
        if self.trigger is not None:
            trigger = self.trigger
        return nodes.changed(transition, type=self.type, trigger=trigger, guard=guard)

    def title(self, document: Document) -> Message:
        return Message("Make {label} fire by {type}", label=self.label(document), type=_TYPES[self.type])


class SetPriority(_TransitionCommand, frozen=True, kw_only=True):
    """Set the priority of a transition as it was typed: a number from 1, or nothing."""

    typed = ("priority",)
    titled = Message("Set the priority of")
    priority: str


class ReorderTransition(_TransitionCommand, frozen=True, kw_only=True):
    """Evaluate a transition at position `index`, from 0, among those out of its state.

    If one of them has a priority, all get one; otherwise their order in the document changes.
    """

    index: Index

    def change(self, automaton: Automaton) -> Automaton:
        chosen = nodes.find_transition(automaton, self.transition)
        former = automaton.outgoing(chosen.origin)
        order = [each for each in former if each is not chosen]
        order.insert(self.index, chosen)
        if all(new is old for new, old in zip(order, former, strict=True)):
            return automaton
        if any(not each.priority.is_blank for each in order):
            ranks = {id(each): str(rank) for rank, each in enumerate(order, 1)}
            transitions = tuple(
                nodes.changed(each, priority=ranks[id(each)]) if id(each) in ranks else each
                for each in automaton.transitions
            )
        else:
            ordered = iter(order)
            moving = {id(each) for each in order}
            transitions = tuple(
                next(ordered) if id(each) in moving else each for each in automaton.transitions
            )
        return nodes.changed(automaton, transitions=transitions)

    def title(self, document: Document) -> Message:
        return Message("Try {label} as number {index}", label=self.label(document), index=self.index + 1)
