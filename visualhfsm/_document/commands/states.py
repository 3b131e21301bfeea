"""Commands for states."""

# ruff: noqa: ARG002 - `Command` documents its methods and their parameters

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal

from codegen.hfsm.document import NO_CHILD, Automaton, Document, State
from codegen.messages import NO_MESSAGE, Message

from .. import nodes
from .base import AutomatonCommand, Command, Id, Language, made_up
from .transitions import AddTransition, TransitionType


class AddState(Command, frozen=True, kw_only=True):
    """Add a state, and a transition to it from `origin`; the first state of an automaton is initial.

    `trigger` is the type of the transition.
    """

    automaton: Id
    x: float
    y: float
    name: str = ""
    origin: Id | None = None
    trigger: TransitionType = "condition"
    language: Language = ""

    def apply(self, document: Document) -> Document:
        number = next(nodes.state_ids(nodes.find_automaton(document, self.automaton)))

        def add(automaton: Automaton) -> Automaton:
            nodes.require_own_content(automaton, Message("Cannot draw in this automaton"))
            taken = {state.name for state in automaton.states}
            state = State(
                id=number,
                name=nodes.checked(self.name, Message("the name"))
                or nodes.free_name(made_up(Message("state {number}", number=number), self.language), taken),
                initial=not any(state.initial for state in automaton.states),
                x=nodes.coordinate(self.x),
                y=nodes.coordinate(self.y),
            )
            return replace(automaton, states=(*automaton.states, state))

        drawn = nodes.with_automaton(document, self.automaton, add)
        if self.origin is None:
            return drawn
        led = AddTransition(
            automaton=self.automaton,
            origin=self.origin,
            destination=number,
            type=self.trigger,
            language=self.language,
        )
        return led.apply(drawn)

    def title(self, document: Document) -> Message:
        return (
            Message("Add a state") if self.origin is None else Message("Add a state and a transition to it")
        )


class _StateCommand(AutomatonCommand, frozen=True, kw_only=True):
    """A change of one state; it sets the fields of the command unless `changed_state` is overridden."""

    titled: ClassVar[Message] = NO_MESSAGE
    state: Id

    def changed_state(self, state: State) -> State:
        return nodes.changed(state, **self.own_fields(_StateCommand))

    def change(self, automaton: Automaton) -> Automaton:
        former = nodes.find_state(automaton, self.state)
        return nodes.changed(
            automaton, states=nodes.swapped(automaton.states, former, self.changed_state(former))
        )

    def title(self, document: Document) -> Message:
        return Message("{what} {label}", what=self.titled, label=self.label(document))

    def label(self, document: Document) -> Message:
        return nodes.label(nodes.find_state(nodes.find_automaton(document, self.automaton), self.state))


class RenameState(_StateCommand, frozen=True, kw_only=True):
    """Rename a state."""

    typed = ("name",)
    titled = Message("Rename")
    name: str


class MarkInitial(_StateCommand, frozen=True, kw_only=True):
    """Make a state the only initial state of its automaton."""

    titled = Message("Start in")

    def change(self, automaton: Automaton) -> Automaton:
        chosen = nodes.find_state(automaton, self.state)
        states = tuple(nodes.changed(state, initial=state is chosen) for state in automaton.states)
        return nodes.changed(automaton, states=states)


class MarkFinal(_StateCommand, frozen=True, kw_only=True):
    """Set whether a state is final."""

    final: bool

    def title(self, document: Document) -> Message:
        state = self.label(document)
        return (
            Message("End in {label}", label=state)
            if self.final
            else Message("Do not end in {label}", label=state)
        )


class SetHistory(_StateCommand, frozen=True, kw_only=True):
    """Set whether the automata of a state resume or restart when it is entered again."""

    titled = Message("Set the history of")
    history: Literal["", "resume", "restart"]


class RemoveArgument(_StateCommand, frozen=True, kw_only=True):
    """Remove the argument for an input."""

    name: str
    child: Id = NO_CHILD

    def changed_state(self, state: State) -> State:
        kept = tuple(each for each in state.arguments if (each.name, each.child) != (self.name, self.child))
        return nodes.changed(state, arguments=kept)

    def title(self, document: Document) -> Message:
        return Message(
            "Remove the argument {name} of {label}", name=self.name[:30], label=self.label(document)
        )


class RemoveResult(_StateCommand, frozen=True, kw_only=True):
    """Take an output no longer."""

    name: str
    child: Id = NO_CHILD

    def changed_state(self, state: State) -> State:
        kept = tuple(each for each in state.results if (each.name, each.child) != (self.name, self.child))
        return nodes.changed(state, results=kept)

    def title(self, document: Document) -> Message:
        return Message("Leave the output {name} in {label}", name=self.name[:30], label=self.label(document))
