"""Commands for states."""

# ruff: noqa: ARG002 - `Command` documents its methods and their parameters

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Final, Literal

from codegen.hfsm.document import NO_CHILD, Argument, Automaton, Document, Result, State, Text
from visualhfsm._errors import EditError

from ..nodes import (
    changed,
    checked,
    coordinate,
    find_automaton,
    find_state,
    free_name,
    label,
    state_ids,
    swapped,
    with_automaton,
)
from .base import AutomatonCommand, Command, Id
from .transitions import AddTransition, TransitionType

_DEFAULT_NAME: Final = "state"


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

    def apply(self, document: Document) -> Document:
        number = next(state_ids(find_automaton(document, self.automaton)))

        def add(automaton: Automaton) -> Automaton:
            if automaton.imported is not None:
                why = "its content comes from another file"
                raise EditError("Cannot draw in this automaton", why, "change that file, or inline it first")
            taken = {state.name for state in automaton.states}
            state = State(
                id=number,
                name=checked(self.name, "the name") or free_name(f"{_DEFAULT_NAME} {number}", taken),
                initial=not any(state.initial for state in automaton.states),
                x=coordinate(self.x),
                y=coordinate(self.y),
            )
            return replace(automaton, states=(*automaton.states, state))

        drawn = with_automaton(document, self.automaton, add)
        if self.origin is None:
            return drawn
        led = AddTransition(
            automaton=self.automaton, origin=self.origin, destination=number, type=self.trigger
        )
        return led.apply(drawn)

    def title(self, document: Document) -> str:
        return "Add a state" if self.origin is None else "Add a state and a transition to it"


class _StateCommand(AutomatonCommand, frozen=True, kw_only=True):
    """A change of one state; it sets the fields of the command unless `changed_state` is overridden."""

    titled: ClassVar[str] = ""
    state: Id

    def changed_state(self, state: State) -> State:
        return changed(state, **self.own_fields(_StateCommand))

    def change(self, automaton: Automaton) -> Automaton:
        former = find_state(automaton, self.state)
        return changed(automaton, states=swapped(automaton.states, former, self.changed_state(former)))

    def title(self, document: Document) -> str:
        return f"{self.titled} {self.label(document)}"

    def label(self, document: Document) -> str:
        return label(find_state(find_automaton(document, self.automaton), self.state))


class RenameState(_StateCommand, frozen=True, kw_only=True):
    """Rename a state."""

    typed = ("name",)
    titled = "Rename"
    name: str


class SetStateCode(_StateCommand, frozen=True, kw_only=True):
    """Set the code that runs at the entry, in every cycle or at the exit of a state."""

    typed = ("text",)
    part: Literal["entry", "code", "exit"]
    text: str

    def changed_state(self, state: State) -> State:
        return changed(state, **{self.part: self.text})

    def title(self, document: Document) -> str:
        what = self.part if self.part == "code" else f"{self.part} code"
        return f"Edit the {what} of {self.label(document)}"


class MarkInitial(_StateCommand, frozen=True, kw_only=True):
    """Make a state the only initial state of its automaton."""

    titled = "Start in"

    def change(self, automaton: Automaton) -> Automaton:
        chosen = find_state(automaton, self.state)
        states = tuple(changed(state, initial=state is chosen) for state in automaton.states)
        return changed(automaton, states=states)


class MarkFinal(_StateCommand, frozen=True, kw_only=True):
    """Set whether a state is final."""

    final: bool

    def title(self, document: Document) -> str:
        return f"{'End' if self.final else 'Do not end'} in {self.label(document)}"


class SetHistory(_StateCommand, frozen=True, kw_only=True):
    """Set whether the automata of a state resume or restart when it is entered again."""

    titled = "Set the history of"
    history: Literal["", "resume", "restart"]


class SetArgument(_StateCommand, frozen=True, kw_only=True):
    """Set the argument of a state for an input of its automata; `child` 0 is the one with the input."""

    typed = ("value",)
    name: str
    value: str
    child: Id = NO_CHILD

    def changed_state(self, state: State) -> State:
        value = checked(self.value, "the argument")
        former = [each for each in state.arguments if (each.name, each.child) == (self.name, self.child)]
        if former:
            arguments = tuple(
                changed(each, value=value) if each is former[0] else each for each in state.arguments
            )
            return changed(state, arguments=arguments)
        if not self.name.strip():
            raise EditError(
                "Cannot add the argument", "it has no name", "name an input of the automaton below"
            )
        name = checked(self.name, "the name of the argument")
        new = Argument(name=name, child=self.child, value=Text(value))
        return changed(state, arguments=(*state.arguments, new))

    def title(self, document: Document) -> str:
        return f"Set the argument {self.name[:30]} of {self.label(document)}"


class RemoveArgument(_StateCommand, frozen=True, kw_only=True):
    """Remove the argument for an input."""

    name: str
    child: Id = NO_CHILD

    def changed_state(self, state: State) -> State:
        kept = tuple(each for each in state.arguments if (each.name, each.child) != (self.name, self.child))
        return changed(state, arguments=kept)

    def title(self, document: Document) -> str:
        return f"Remove the argument {self.name[:30]} of {self.label(document)}"


class SetResult(_StateCommand, frozen=True, kw_only=True):
    """Set the variable that takes an output of a state's automata; `child` 0 is the one with the output."""

    name: str
    variable: str
    child: Id = NO_CHILD

    def changed_state(self, state: State) -> State:
        variable = checked(self.variable, "the variable")
        former = [each for each in state.results if (each.name, each.child) == (self.name, self.child)]
        if former:
            results = tuple(
                changed(each, variable=variable) if each is former[0] else each for each in state.results
            )
            return changed(state, results=results)
        if not self.name.strip():
            raise EditError(
                "Cannot add the result", "it has no name", "name an output of the automaton below"
            )
        name = checked(self.name, "the name of the result")
        new = Result(name=name, child=self.child, variable=Text(variable))
        return changed(state, results=(*state.results, new))

    def title(self, document: Document) -> str:
        return f"Take the output {self.name[:30]} in {self.label(document)}"


class RemoveResult(_StateCommand, frozen=True, kw_only=True):
    """Take an output no longer."""

    name: str
    child: Id = NO_CHILD

    def changed_state(self, state: State) -> State:
        kept = tuple(each for each in state.results if (each.name, each.child) != (self.name, self.child))
        return changed(state, results=kept)

    def title(self, document: Document) -> str:
        return f"Leave the output {self.name[:30]} in {self.label(document)}"
