"""What all commands have in common: they refuse what no file can hold, and notice that nothing changes."""

from __future__ import annotations

import pytest

from codegen.hfsm.document import Document
from tests.support.editing import texted, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import Command, in_language
from visualhfsm._document.commands.automata import AddRoot
from visualhfsm._document.commands.component import AddEntry
from visualhfsm._document.commands.group import GroupStates
from visualhfsm._document.commands.items import MoveItems
from visualhfsm._document.commands.states import AddState, MarkInitial, RemoveArgument, RenameState
from visualhfsm._document.commands.transitions import RetargetTransition


def test_text_that_no_file_can_hold_is_refused_with_its_line() -> None:
    with pytest.raises(EditError, match=r"line 2 has the control character U\+001B"):
        texted(tree(), "a\n\x1b", kind="state", id=1, part="code")
    with pytest.raises(EditError, match="more than"):
        texted(tree(), "x" * (1 << 21), kind="state", id=1, part="code")


def test_a_command_that_changes_nothing_returns_the_document_itself() -> None:
    document = tree()
    for command in (
        RenameState(automaton=1, state=1, name="wait"),
        MoveItems(automaton=1, states=(1,), dx=0, dy=0),
        MarkInitial(automaton=1, state=1),
        RetargetTransition(automaton=1, transition=1, destination=2),
        RemoveArgument(automaton=1, state=1, name="x"),
    ):
        assert command.apply(document) is document, command


def test_names_that_are_made_up_are_in_the_language_of_the_page() -> None:
    commands: list[Command] = [
        AddState(automaton=1, x=0, y=0),
        AddState(automaton=1, x=200, y=0, origin=1),
        GroupStates(automaton=1, states=(2,)),
        *(AddEntry(list=each) for each in ("parameters", "interfaces", "events", "properties")),
        *(AddEntry(list=each, automaton=2) for each in ("inputs", "outputs")),
    ]
    document = AddRoot().apply(Document())
    for command in commands:
        document = in_language(command, "es").apply(document)
    root, group = document.automata
    assert [each.name for each in (*root.states, *group.states)] == ["estado 1", "grupo", "estado 2"]
    assert [each.name for each in root.transitions] == ["transición 1"]
    lists = (document.events, document.properties, document.parameters, document.interfaces)
    names = [each.name for entries in (*lists, group.inputs, group.outputs) for each in entries]
    assert names == ["evento", "propiedad", "parametro", "interfaz", "entrada", "salida"]


def test_a_command_keeps_the_language_that_it_came_with() -> None:
    asked = AddState(automaton=1, x=0, y=0, language="en")
    assert in_language(asked, "es") is asked
    move = MoveItems(automaton=1, states=(1,), dx=0, dy=0)
    assert in_language(move, "es") is move
