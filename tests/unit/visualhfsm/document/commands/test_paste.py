"""Copy, cut and paste: whole sub-trees, with new numbers, into any automaton of any document."""

from __future__ import annotations

import math
from itertools import combinations
from pathlib import Path

import msgspec
import pytest

from codegen.hfsm.document import Argument, Automaton, Document, Result, State, Text
from codegen.messages import Message
from tests.support.editing import large_document, texted, tree
from visualhfsm import Project
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.automata import AddAutomaton, SetImport
from visualhfsm._document.commands.items import DeleteItems
from visualhfsm._document.commands.paste import AddReadyState, FillAutomaton, PasteStates
from visualhfsm._document.commands.states import RenameState
from visualhfsm._document.serialization import copy_states, parse, written

RADIUS = 40.0  # of a state, as measures/geometry.js draws it


def automaton(document: Document, id: int) -> Automaton:
    found = document.automaton(id)
    assert found is not None
    return found


def test_a_state_is_pasted_with_its_whole_sub_tree_under_new_numbers() -> None:
    document = texted(tree(), "1", kind="state", id=2, part="argument", name="n", child=3)
    document = texted(document, "x", kind="state", id=2, part="result", name="o", child=3)
    document = PasteStates(automaton=1, content=copy_states(document, 1, [2])).apply(document)
    pasted = automaton(document, 1).states[2]
    assert (pasted.id, pasted.name, pasted.children) == (3, "work 2", (5, 7))
    assert pasted.arguments == (Argument(name="n", child=7, value=Text("1")),)
    assert pasted.results == (Result(name="o", child=7, variable=Text("x")),)
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


@pytest.mark.parametrize(
    ("x", "y"), [(None, None), (131.0, 77.0)], ids=["beside what was copied", "at the pointer"]
)
def test_pasted_states_never_touch_others_however_often(x: float | None, y: float | None) -> None:
    document = tree()
    for content in [copy_states(document, 1, [1]), copy_states(document, 1, [1, 2])] * 3:
        document = PasteStates(automaton=1, content=content, x=x, y=y).apply(document)
    states = automaton(document, 1).states
    assert len(states) == 11
    assert all(math.dist((a.x, a.y), (b.x, b.y)) > 2 * RADIUS for a, b in combinations(states, 2))


@pytest.mark.parametrize("x", [math.inf, math.nan, 1e300])
def test_nothing_is_pasted_outside_of_the_canvas(x: float) -> None:
    with pytest.raises(EditError, match="is not within"):
        PasteStates(automaton=1, content=copy_states(tree(), 1, [1]), x=x, y=0).apply(tree())


def test_a_state_is_pasted_into_its_own_sub_tree() -> None:
    document = tree()
    document = PasteStates(automaton=4, content=copy_states(document, 1, [2])).apply(document)
    copied = automaton(document, 4).states[1]
    assert copied.children == (5, 7)
    assert [each.father for each in document.automata] == [0, 1, 1, 2, 4, 5, 4]


def test_pasting_twice_what_was_cut_brings_it_back_twice(tmp_path: Path) -> None:
    session = Project(tmp_path, journals=tmp_path).open_text("test", written(tree()))
    text, change = session.cut(1, (2,))
    assert change.name == "Cut “work”"
    assert len(session.version.document.automata) == 1
    for _ in range(2):
        change = session.apply(PasteStates(automaton=1, content=text))
    assert [(each.automaton, each.states) for each in change.added] == [
        (1, (3,)),
        (5, (1, 2)),
        (6, (1,)),
        (7, (1,)),
    ]
    for _ in range(3):
        session.undo()
    assert written(session.version.document) == written(tree())
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
    (copied,) = parse(copy_states(tree(), 1, [1]), Message("Cannot read")).automata
    assert [each.name for each in copied.states] == ["wait"]
    assert copied.transitions == ()


READY = """<VisualHFSM>
  <parameters><parameter><name>pace</name><type>float</type><default>1.0</default></parameter></parameters>
  <SubAutomata id="1" idFather="0">
    <state id="1" initial="true"><name>go</name><idSubautomataSon>7</idSubautomataSon></state>
    <state id="2"><name>gone</name><final>true</final></state>
    <transition id="1"><origin>1</origin><destiny>2</destiny><trans type="finished"></trans></transition>
    <input><name>far</name><type>float</type><default>0.5</default></input>
    <variables>steps = 0</variables>
    <functions>def count(self): return 1</functions>
  </SubAutomata>
  <SubAutomata id="7" idFather="1">
    <state id="1" initial="true"><name>step</name></state>
    <state id="2"><name>stepped</name><final>true</final></state>
  </SubAutomata>
  <libraries><lib>math</lib></libraries>
  <config>
    <iceinterface><nameinterface>Walk</nameinterface><interface>{type}</interface></iceinterface>
  </config>
</VisualHFSM>"""


def ready(**fields: object) -> AddReadyState:
    content = READY.format(type="Walk")
    return msgspec.convert(
        {
            "command": "addReadyState",
            "automaton": 1,
            "content": content,
            "name": "work",
            "x": 7,
            "y": 8,
            **fields,
        },
        AddReadyState,
    )


def test_a_ready_state_is_a_state_with_a_copy_of_the_whole_document() -> None:
    document = ready().apply(tree())
    drawn = automaton(document, 1).states[-1]
    assert (drawn.name, drawn.x, drawn.y, drawn.initial) == ("work 2", 7.0, 8.0, False)
    assert drawn.history == Text("restart")
    assert [(each.name, each.value.text) for each in drawn.arguments] == [("far", "0.5")]
    child = automaton(document, drawn.children[0])
    assert child.father == 1
    assert child.variables == Text("steps = 0")
    assert [each.name for each in child.inputs] == ["far"]
    assert automaton(document, child.states[0].children[0]).father == child.id
    assert [each.name.text for each in document.libraries][-1:] == ["math"]
    assert [each.name for each in document.interfaces][-1:] == ["Walk"]
    assert [each.name for each in document.parameters][-1:] == ["pace"]
    assert parse(written(document), Message("written")) == document


def test_a_ready_state_follows_another_state() -> None:
    document = ready(origin=2, trigger="finished").apply(tree())
    led = automaton(document, 1).transitions[-1]
    assert (led.origin, led.destination, led.type) == (2, automaton(document, 1).states[-1].id, "finished")


def test_the_first_state_of_a_document_is_initial_and_functions_are_not_repeated() -> None:
    document = ready().apply(ready().apply(Document(automata=(Automaton(id=1),))))
    assert [(each.name, each.initial) for each in automaton(document, 1).states] == [
        ("work", True),
        ("work 2", False),
    ]
    assert [bool(each.functions.text) for each in document.automata] == [False, True, False, False, False]
    assert len(document.interfaces) == len(document.libraries) == 1


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        (
            {"content": READY.format(type="jderobot::Motors")},
            r"needs self\.Walk as Motors, and here that is Walk",
        ),
        ({"content": READY.format(type="nao.Walk").replace("float", "int")}, r"needs self\.pace as int"),
        ({"content": "<VisualHFSM/>"}, "no root automaton"),
        ({"content": READY.replace("<libraries>", "<language>C++</language><libraries>")}, r"code is C\+\+"),
        ({"automaton": 9}, "does not exist"),
        ({"origin": 99}, "does not exist"),
        ({"x": 1e9}, "not within"),
        ({"name": "\x00"}, "control character"),
    ],
)
def test_a_ready_state_that_does_not_fit_is_refused(changes: dict[str, object], why: str) -> None:
    document = ready().apply(tree())
    with pytest.raises(EditError, match=why):
        ready(**changes).apply(document)


def test_a_ready_state_of_the_same_things_fits() -> None:
    document = ready().apply(tree())
    again = ready(content=READY.format(type="nao::Walk")).apply(document)
    assert again.interfaces == document.interfaces
