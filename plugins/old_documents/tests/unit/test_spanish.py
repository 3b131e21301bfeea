"""Documents of 2013, whose elements are in Spanish."""

from __future__ import annotations

from codegen.hfsm import write_document
from codegen.hfsm.document import Element
from plugins.old_documents.tests.support.old_dialects import SPANISH, in_spanish, read, shape


def test_reads_the_automata_of_2013() -> None:
    document, found = read(SPANISH)
    root, child = document.automata
    assert (root.id, root.father, child.id, child.father) == (1, 0, 4, 1)
    assert (root.iteration_time.text, child.iteration_time.text) == ("175", "100")
    assert (root.variables.text, root.functions.text) == ("a = 0", "def f(self): pass")
    state = root.states[0]
    assert (state.id, state.name, state.initial, state.x, state.y) == (1, "buscar pelota", True, 10.0, 20.5)
    assert (state.children, state.code.text) == ((4,), "a = 1\n  b = 2 ")
    assert [library.name.text for library in document.libraries] == ["laser", "motor", "radar"]
    assert {library.kind for library in document.libraries} == {"driver"}
    assert child.states[0].children == (9,)
    assert [message[:4] for message in found] == ["N501"] * 5


def test_reads_the_transitions_of_2013() -> None:
    document, _ = read(SPANISH)
    first, second = document.automata[0].transitions
    assert shape(first) == (1, "vista", 1, 2, "condition", "a < b", 1.0, 2.0)
    assert shape(second) == (2, "", 1, 1, "time", "500", 3.0, 4.0)
    (without,) = document.automata[1].transitions
    assert shape(without) == (1, "", 1, 1, "condition", "", 0.0, 0.0)
    assert first.extras == (Element("box", (("x1", "1"), ("y1", "2"), ("x2", "7"), ("y2", "8"))),)


def test_an_automaton_of_2013_that_names_no_father_belongs_to_the_state_that_names_it() -> None:
    document, found = read(SPANISH.replace("<idPadre>1</idPadre>", ""))
    assert document.automata[1].father == 1
    assert any(message.startswith("W502") for message in found)


def test_a_condition_beside_a_time_is_kept() -> None:
    document = in_spanish(
        "<Estado><id>1</id><transiciones><transicion><destino>1</destino><codigo>c</codigo><tiempo>5</tiempo>"
        "</transicion></transiciones></Estado>"
    )
    (transition,) = document.automata[0].transitions
    assert (transition.type, transition.trigger.text) == ("time", "5")
    assert transition.extras == (Element("codigo", (), "c"),)


def test_an_unknown_element_with_a_native_name_does_not_become_what_it_is_called() -> None:
    document = in_spanish(
        "<Estado><id>1</id><entry>x</entry><final>true</final></Estado><functions>y</functions>"
    )
    again, _ = read(write_document(document))
    assert again == document
    (state,) = again.automata[0].states
    assert (state.entry.text, state.final, again.automata[0].functions.text) == ("", False, "")
    assert state.extras[0] == Element("kept", children=(Element("entry", (), "x"),))


def test_comments_and_unknown_elements_of_2013_survive() -> None:
    text = (
        "<VisualHFSM><SubAutomata><!-- a --><idSub>1</idSub><Estado color='red'><id nota='b'>1</id><!-- c --><nombre>n</nombre>"
        "<transiciones orden='d'><!-- e --><transicion f='g'><destino>1</destino></transicion><!-- h --><otro>i</otro>"
        "</transiciones></Estado></SubAutomata></VisualHFSM>"
    )
    document, found = read(text)
    written = write_document(document)
    again, _ = read(written)
    assert again == document
    for piece in (*(f"<!-- {each} -->" for each in "aceh"), 'f="g"', "<otro>i</otro>"):
        assert written.count(piece) == 1, piece
    assert [message for message in found if message.startswith("W501")] == [
        "W501: attributes of `id` are lost on saving",
        "W501: attributes of `transiciones` are lost on saving",
    ]
