"""Commands for automata and their tree."""

# ruff: noqa: ARG002 - `Command` documents its methods and their parameters

from __future__ import annotations

from dataclasses import replace

from codegen.hfsm.document import NO_CHILD, Automaton, Document, Import, State, Text
from codegen.messages import Message
from visualhfsm._base.errors import EditError

from .. import nodes
from ..subtrees import hanging, without_automata
from .base import AutomatonCommand, Command, Id


class AddAutomaton(Command, frozen=True, kw_only=True):
    """Add an empty automaton to a state."""

    automaton: Id
    state: Id

    def apply(self, document: Document) -> Document:
        father = nodes.find_automaton(document, self.automaton)
        state = nodes.find_state(father, self.state)
        nodes.require_room(document, 1, Message("Cannot add an automaton"))
        number = next(nodes.automaton_ids(document))
        new = replace(
            father,
            states=nodes.swapped(father.states, state, replace(state, children=(*state.children, number))),
        )
        automata = nodes.swapped(document.automata, father, new)
        return replace(document, automata=(*automata, Automaton(id=number, father=father.id)))

    def title(self, document: Document) -> Message:
        state = nodes.find_state(nodes.find_automaton(document, self.automaton), self.state)
        return Message("Add an automaton to {state}", state=nodes.label(state))


class AddRoot(Command, frozen=True, kw_only=True):
    """Add the root automaton to a document that has none."""

    def apply(self, document: Document) -> Document:
        if any(automaton.father == NO_CHILD for automaton in document.automata):
            raise EditError("Cannot add the root", "there is already one", "add automata below its states")
        new = Automaton(id=next(nodes.automaton_ids(document)))
        return replace(document, automata=(new, *document.automata))

    def title(self, document: Document) -> Message:
        return Message("Add the root")


class SetPeriod(AutomatonCommand, frozen=True, kw_only=True):
    """Set the period of an automaton in milliseconds, as it was typed."""

    typed = ("period",)
    period: str

    def change(self, automaton: Automaton) -> Automaton:
        return nodes.changed(automaton, iteration_time=self.period)

    def title(self, document: Document) -> Message:
        return Message("Set the period to {period} ms", period=self.period.strip()[:20])


class SetImport(AutomatonCommand, frozen=True, kw_only=True):
    """Import the content of an empty automaton from another file, or remove the import when `file` is blank.

    `source` is the automaton in that file, 0 for its root.
    """

    typed = ("file", "source")
    file: str
    source: Id = NO_CHILD

    def change(self, automaton: Automaton) -> Automaton:
        if not self.file.strip():
            return nodes.changed(automaton, imported=None)
        if automaton.father == NO_CHILD:
            why = Message("it is the root")
            raise EditError("Cannot import this automaton", why, "import into an automaton of a state")
        if automaton.states or automaton.transitions or automaton.inputs or automaton.outputs:
            why = Message("it has states, transitions, inputs or outputs")
            raise EditError("Cannot import this automaton", why, "import into an empty one")
        file = nodes.checked(self.file, Message("the name of the file"))
        if automaton.imported is None:
            return nodes.changed(automaton, imported=Import(file=Text(file), automaton=self.source))
        imported = nodes.changed(automaton.imported, file=Text(file), automaton=self.source)
        return nodes.changed(automaton, imported=imported)

    def title(self, document: Document) -> Message:
        return (
            Message("Import {file}", file=self.file.strip()[:40])
            if self.file.strip()
            else Message("Import nothing")
        )


class ExtractAutomaton(Command, frozen=True, kw_only=True):
    """Import an automaton from a file to which its content was moved; all automata below it are removed."""

    automaton: Id
    file: str

    def apply(self, document: Document) -> Document:
        automaton = nodes.find_automaton(document, self.automaton)
        document = without_automata(document, hanging(document, automaton, automaton.states))

        def empty(former: Automaton) -> Automaton:
            imported = Import(file=Text(nodes.checked(self.file, Message("the name of the file"))))
            stub = Automaton(id=former.id, father=former.father, imported=imported)
            return replace(stub, comments=former.comments, iteration_time=former.iteration_time)

        return nodes.with_automaton(document, self.automaton, empty)

    def title(self, document: Document) -> Message:
        return Message("Move the automaton to {file}", file=self.file[:40])


class RepairNumbers(Command, frozen=True, kw_only=True):
    """Give automata, states and transitions that share a number different ones.

    The first keeps its number, and references to it. A second automaton is then below no state.
    """

    def apply(self, document: Document) -> Document:
        ids = nodes.automaton_ids(document)
        seen: set[int] = set()
        automata = []
        for automaton in document.automata:
            repaired = _with_own_numbers(automaton)
            if automaton.id in seen:
                repaired = replace(repaired, id=next(ids))
            seen.add(automaton.id)
            automata.append(repaired)
        return nodes.changed(document, automata=tuple(automata))

    def title(self, document: Document) -> Message:
        return Message("Repair numbers")


def _with_own_numbers(automaton: Automaton) -> Automaton:
    state_numbers, transition_numbers = nodes.state_ids(automaton), nodes.transition_ids(automaton)
    seen_states: set[int] = set()
    seen_transitions: set[int] = set()
    states: list[State] = []
    for state in automaton.states:
        states.append(replace(state, id=next(state_numbers)) if state.id in seen_states else state)
        seen_states.add(state.id)
    transitions = []
    for transition in automaton.transitions:
        is_second = transition.id in seen_transitions
        transitions.append(replace(transition, id=next(transition_numbers)) if is_second else transition)
        seen_transitions.add(transition.id)
    return nodes.changed(automaton, states=tuple(states), transitions=tuple(transitions))
