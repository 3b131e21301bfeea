"""Commands that add and change automata."""

from __future__ import annotations

import pytest

from codegen.hfsm.document import Automaton, Document, State, Transition
from tests.support.editing import automaton, state, texted, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.automata import AddAutomaton, RepairNumbers, SetImport, SetPeriod
from visualhfsm._document.commands.states import AddState, RenameState


def test_a_state_gets_further_automata() -> None:
    document = AddAutomaton(automaton=1, state=2).apply(tree())
    assert state(document, 2).children == (2, 3, 5)
    assert automaton(document, 5) == Automaton(id=5, father=1)


def test_the_data_of_an_automaton_is_set() -> None:
    document = SetPeriod(automaton=2, period="50").apply(tree())
    document = texted(document, "n = 0", kind="automaton", automaton=2, part="variables")
    document = texted(document, "def f(self): pass", kind="automaton", automaton=2, part="functions")
    new = automaton(document, 2)
    assert (new.iteration_time.text, new.variables.text, new.functions.text) == (
        "50",
        "n = 0",
        "def f(self): pass",
    )


def test_an_empty_automaton_imports_and_no_more() -> None:
    document = AddAutomaton(automaton=1, state=1).apply(tree())
    document = SetImport(automaton=5, file="search.xml", source=2).apply(document)
    document = SetImport(automaton=5, file="other.xml").apply(document)
    imported = automaton(document, 5).imported
    assert imported is not None
    assert (imported.file.text, imported.automaton) == ("other.xml", 0)
    with pytest.raises(EditError, match="comes from another file"):
        AddState(automaton=5, x=0, y=0).apply(document)
    assert automaton(SetImport(automaton=5, file="").apply(document), 5).imported is None
    with pytest.raises(EditError, match="states, transitions, inputs or outputs"):
        SetImport(automaton=2, file="search.xml").apply(document)
    with pytest.raises(EditError, match="it is the root"):
        SetImport(automaton=1, file="search.xml").apply(document)


def test_numbers_that_two_share_are_reported_and_repaired() -> None:
    twins = (State(id=1, name="a"), State(id=1, name="b"))
    arrows = (Transition(id=1, origin=1, destination=1), Transition(id=1, origin=1, destination=1))
    document = Document(automata=(Automaton(id=1, states=twins, transitions=arrows), Automaton(id=1)))
    with pytest.raises(EditError, match="Repair numbers"):
        RenameState(automaton=1, state=1, name="c").apply(document)
    repaired = RepairNumbers().apply(document)
    assert [each.id for each in repaired.automata] == [1, 2]
    assert [each.id for each in repaired.automata[0].states] == [1, 2]
    assert [each.id for each in repaired.automata[0].transitions] == [1, 2]
    assert state(RenameState(automaton=1, state=1, name="c").apply(repaired), 1).name == "c"
