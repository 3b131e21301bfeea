"""Copy, cut and paste: whole sub-trees, with new numbers, into any automaton of any document."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.hfsm.document import Argument, Automaton, Document, State, Text
from tests.support.editing import large_document, tree
from visualhfsm._editing.commands.automata import AddAutomaton, SetImport
from visualhfsm._editing.commands.items import DeleteItems
from visualhfsm._editing.commands.paste import FillAutomaton, PasteStates
from visualhfsm._editing.commands.states import RenameState, SetArgument
from visualhfsm._editing.serialization import copy_states, parse, written
from visualhfsm._errors import EditError
from visualhfsm._sessions.session import DocumentSession


def automaton(document: Document, id: int) -> Automaton:
    found = document.automaton(id)
    assert found is not None
    return found


def test_a_state_is_pasted_with_its_whole_sub_tree_under_new_numbers() -> None:
    document = SetArgument(automaton=1, state=2, name="n", value="1", child=3).apply(tree())
    document = PasteStates(automaton=1, content=copy_states(document, 1, [2])).apply(document)
    pasted = automaton(document, 1).states[2]
    assert (pasted.id, pasted.name, pasted.children) == (3, "work 2", (5, 7))
    assert pasted.arguments == (Argument(name="n", child=7, value=Text("1")),)
    assert [(each.id, each.father) for each in document.automata[4:]] == [(5, 1), (6, 5), (7, 1)]
    assert automaton(document, 5).states[0].children == (6,)
    assert automaton(document, 6).states == automaton(document, 4).states
    assert automaton(document, 5).transitions == automaton(document, 2).transitions


def test_transitions_among_the_states_come_along_and_no_others() -> None:
    document = tree()
    pasted = automaton(PasteStates(automaton=3, content=copy_states(document, 1, [1, 2])).apply(document), 3)
    assert [(each.id, each.origin, each.destination) for each in pasted.transitions] == [(1, 2, 3), (2, 3, 2)]
    alone = automaton(PasteStates(automaton=3, content=copy_states(document, 1, [1])).apply(document), 3)
    assert alone.transitions == ()


def test_what_is_pasted_is_initial_only_where_nothing_is() -> None:
    content = copy_states(tree(), 1, [1, 2])
    document = PasteStates(automaton=1, content=content).apply(tree())
    assert [each.initial for each in automaton(document, 1).states] == [True, False, False, False]
    document = PasteStates(automaton=1, content=content).apply(Document(automata=(Automaton(id=1),)))
    assert [(each.name, each.initial) for each in automaton(document, 1).states] == [
        ("wait", True),
        ("work", False),
    ]


def test_names_stay_where_they_are_free_and_are_numbered_where_not() -> None:
    document = tree()
    for _ in range(3):
        document = PasteStates(automaton=1, content=copy_states(document, 1, [1])).apply(document)
    assert [each.name for each in automaton(document, 1).states] == [
        "wait",
        "work",
        "wait 2",
        "wait 3",
        "wait 4",
    ]


def test_a_numbered_name_gets_the_next_number() -> None:
    document = RenameState(automaton=1, state=1, name="wait 2").apply(tree())
    document = PasteStates(automaton=1, content=copy_states(document, 1, [1])).apply(document)
    assert automaton(document, 1).states[2].name == "wait 3"


def test_pasted_states_do_not_hide_others_and_go_where_they_are_put() -> None:
    content = copy_states(tree(), 1, [1, 2])
    document = PasteStates(automaton=1, content=content).apply(tree())
    assert [(each.x, each.y) for each in automaton(document, 1).states[2:]] == [
        (190.0, 190.0),
        (390.0, 190.0),
    ]
    assert [(each.x, each.y) for each in automaton(document, 1).transitions[2:]] == [
        (290.0, 170.0),
        (290.0, 210.0),
    ]
    document = PasteStates(automaton=1, content=content, x=0, y=-50).apply(tree())
    assert [(each.x, each.y) for each in automaton(document, 1).states[2:]] == [(0.0, -50.0), (200.0, -50.0)]


def test_a_state_is_pasted_into_its_own_sub_tree() -> None:
    document = tree()
    document = PasteStates(automaton=4, content=copy_states(document, 1, [2])).apply(document)
    copied = automaton(document, 4).states[1]
    assert copied.children == (5, 7)
    assert [each.father for each in document.automata] == [0, 1, 1, 2, 4, 5, 4]


def test_pasting_twice_what_was_cut_brings_it_back_twice(tmp_path: Path) -> None:
    session = DocumentSession.new(tree(), "test", journals=tmp_path)
    text, change = session.cut(1, (2,))
    assert change.name == "Cut “work”"
    assert len(session.document.automata) == 1
    for _ in range(2):
        change = session.do(PasteStates(automaton=1, content=text))
    assert [(each.automaton, each.states) for each in change.added] == [
        (1, (3,)),
        (5, (1, 2)),
        (6, (1,)),
        (7, (1,)),
    ]
    for _ in range(3):
        session.undo()
    assert written(session.document) == written(tree())
    session.close(discard=True)


def test_what_is_not_there_is_not_copied() -> None:
    dangling = Document(automata=(Automaton(id=1, states=(State(id=1, name="s", children=(1, 9)),)),))
    document = PasteStates(automaton=1, content=copy_states(dangling, 1, [1])).apply(dangling)
    assert document.automata[0].states[1].children == ()
    with pytest.raises(EditError, match="state 2 of automaton 1: it does not exist"):
        copy_states(dangling, 1, [2])
    with pytest.raises(EditError, match="no state is selected"):
        copy_states(dangling, 1, [])


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("", "malformed XML"),
        ("hello", "malformed XML"),
        ("<html/>", "not the root of a document"),
        ("<VisualHFSM/>", "it contains no states"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><VisualHFSM>&b;</VisualHFSM>', "document type"),
        ('<VisualHFSM><SubAutomata id="1"><state id="1"/></SubAutomata>' + '<SubAutomata id="2"/>' * 2 + "</VisualHFSM>",
         "two automata in it have the number 2"),
    ],
)  # fmt: skip
def test_what_is_no_copied_state_is_refused(content: str, why: str) -> None:
    with pytest.raises(EditError, match=why):
        PasteStates(automaton=1, content=content).apply(tree())


def test_nothing_is_pasted_into_an_imported_automaton() -> None:
    document = AddAutomaton(automaton=1, state=1).apply(tree())
    document = SetImport(automaton=5, file="a.xml").apply(document)
    with pytest.raises(EditError, match="comes from another file"):
        PasteStates(automaton=5, content=copy_states(document, 1, [1])).apply(document)


@pytest.mark.slow
def test_a_deep_tree_is_copied_and_deleted() -> None:
    document = large_document(2000, 1000)
    pasted = PasteStates(automaton=1, content=copy_states(document, 1, [1])).apply(document)
    assert len(pasted.automata) == 1999
    assert len(DeleteItems(automaton=1, states=(1,)).apply(pasted).automata) == 1000


def test_filling_an_automaton_takes_away_what_was_below_it() -> None:
    document = FillAutomaton(automaton=2, content=written(tree())).apply(tree())
    assert [(each.id, each.father) for each in document.automata] == [
        (1, 0),
        (2, 1),
        (3, 1),
        (4, 2),
        (5, 2),
        (6, 4),
    ]
    assert [each.children for each in automaton(document, 2).states] == [(), (4, 5)]


def test_a_clipboard_is_text_that_is_a_document() -> None:
    (copied,) = parse(copy_states(tree(), 1, [1]), "Cannot read").automata
    assert [each.name for each in copied.states] == ["wait"]
    assert copied.transitions == ()
