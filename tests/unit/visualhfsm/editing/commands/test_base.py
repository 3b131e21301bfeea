"""What all commands have in common: they refuse what no file can hold, and notice that nothing changes."""

from __future__ import annotations

import pytest

from tests.support.editing import tree
from visualhfsm._editing.commands.items import MoveItems
from visualhfsm._editing.commands.states import MarkInitial, RemoveArgument, RenameState, SetStateCode
from visualhfsm._editing.commands.transitions import RetargetTransition
from visualhfsm._errors import EditError


def test_text_that_no_file_can_hold_is_refused_with_its_line() -> None:
    with pytest.raises(EditError, match=r"line 2 has the control character U\+001B"):
        SetStateCode(automaton=1, state=1, part="code", text="a\n\x1b").apply(tree())
    with pytest.raises(EditError, match="more than"):
        SetStateCode(automaton=1, state=1, part="code", text="x" * (1 << 21)).apply(tree())


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
