"""Commands that add and change states."""

from __future__ import annotations

import pytest

from codegen.hfsm.document import Argument, Automaton, Document, Result, Text, Transition
from tests.support.editing import automaton, state, texted, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.automata import AddRoot
from visualhfsm._document.commands.states import (
    AddState,
    MarkFinal,
    MarkInitial,
    RemoveArgument,
    RemoveResult,
    RenameState,
    SetHistory,
)


def test_a_first_state_is_initial_and_all_get_numbers_and_names_of_their_own() -> None:
    document = AddRoot().apply(Document())
    for x in (0.0, 50.123456):
        document = AddState(automaton=1, x=x, y=-1).apply(document)
    first, second = automaton(document).states
    assert (first.id, first.name, first.initial) == (1, "state 1", True)
    assert (second.id, second.name, second.initial, second.x) == (2, "state 2", False, 50.12)


def test_a_state_is_drawn_with_a_transition_to_it_in_one_step() -> None:
    command = AddState(automaton=1, x=300, y=0, origin=1)
    document = command.apply(tree())
    drawn = automaton(document).transitions[-1]
    assert (drawn.origin, drawn.destination) == (1, automaton(document).states[-1].id)
    assert command.title(tree()) == "Add a state and a transition to it"
    with pytest.raises(EditError, match="state 99"):
        AddState(automaton=1, x=0, y=0, origin=99).apply(tree())


def test_the_number_of_a_deleted_state_does_not_come_back_while_a_transition_names_it() -> None:
    document = Document(automata=(Automaton(id=1, transitions=(Transition(id=1, origin=5, destination=5),)),))
    assert state(AddState(automaton=1, x=0, y=0).apply(document), 6).name == "state 6"


def test_a_state_is_renamed_and_its_pieces_of_code_are_set() -> None:
    document = RenameState(automaton=1, state=1, name="<rest>").apply(tree())
    for part in ("entry", "code", "exit"):
        document = texted(document, f"{part} = 1\n", kind="state", id=1, part=part)
    changed = state(document, 1)
    assert (changed.name, changed.entry.text, changed.code.text, changed.exit.text) == (
        "<rest>", "entry = 1\n", "code = 1\n", "exit = 1\n"
    )  # fmt: skip


def test_only_one_state_is_initial() -> None:
    document = MarkInitial(automaton=1, state=2).apply(tree())
    assert [each.initial for each in automaton(document).states] == [False, True]


def test_a_state_is_final_and_no_more() -> None:
    document = MarkFinal(automaton=1, state=1, final=True).apply(tree())
    assert state(document, 1).final
    assert not state(MarkFinal(automaton=1, state=1, final=False).apply(document), 1).final


def test_the_history_of_a_state_is_set() -> None:
    assert (
        state(SetHistory(automaton=1, state=2, history="restart").apply(tree()), 2).history.text == "restart"
    )


@pytest.mark.parametrize(
    ("part", "remove", "given", "text"),
    [
        ("argument", RemoveArgument, Argument(name="times", child=2, value=Text("4")), ""),
        ("result", RemoveResult, Result(name="times", child=2, variable=Text("4")), "x"),
    ],
)
def test_arguments_and_results_are_added_changed_and_removed(
    part: str, remove: type[RemoveArgument | RemoveResult], given: Argument | Result, text: str
) -> None:
    document = texted(tree(), "3", kind="state", id=2, part=part, name="times", child=2)
    document = texted(document, "4", kind="state", id=2, part=part, name="times", child=2)
    assert getattr(state(document, 2), f"{part}s") == (given,)
    removed = remove(automaton=1, state=2, name="times", child=2).apply(document)
    assert getattr(state(removed, 2), f"{part}s") == ()
    with pytest.raises(EditError, match="it has no name"):
        texted(document, text, kind="state", id=2, part=part, name=" ")
