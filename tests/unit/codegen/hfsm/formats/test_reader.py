"""Reading and writing documents: places, errors, and nothing lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, read_document, write_document
from codegen.hfsm.document import Comment, Document, Element
from tests.support.any_text import any_text
from tests.support.examples import examples
from tests.support.plugins import OLD_DOCUMENTS

PATH = Path("test.xml")

DOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<!-- by hand -->
<VisualHFSM>
  <SubAutomata id="1" idFather="0">
    <!-- where it begins -->
    <state initial="true" id="1">
      <posx>118.113</posx>
      <posy>121</posy>
      <name>go to wall</name>
      <idSubautomataSon>0</idSubautomataSon>
      <code>
self.motors.setV(0.2)
if 1 &lt; 2: pass</code>
      <ours:breakpoint xmlns:ours="x" ours:when="a &gt; b">
        <deep/>
      </ours:breakpoint>
    </state>
    <transition id="7">
      <posx>1</posx>
      <posy>2</posy>
      <origin>1</origin>
      <destiny>1</destiny>
      <transcode></transcode>
      <name>again</name>
      <trans type="time">1500</trans>
    </transition>
    <iteration_time>50</iteration_time>
    <variables></variables>
    <functions></functions>
  </SubAutomata>
  <libraries>
    <lib>numpy as np</lib>
  </libraries>
  <config>
    <iceinterface>
      <nameinterface>motors</nameinterface>
      <nameproxy>Motors</nameproxy>
      <ip>localhost</ip>
      <port>9001</port>
      <interface>Motors</interface>
    </iceinterface>
  </config>
</VisualHFSM>
"""


def parse(text: str | bytes) -> Document:
    diagnostics = Diagnostics()
    document = parse_document(text, PATH, diagnostics)
    assert document is not None, diagnostics.render()
    return document


def errors(text: str | bytes) -> list[str]:
    diagnostics = Diagnostics()
    assert parse_document(text, PATH, diagnostics) is None
    return [f"{found.location}: {found.message}" for found in diagnostics.errors]


def test_reads_every_part_of_a_document() -> None:
    document = parse(DOCUMENT)
    (automaton,) = document.automata
    (state,) = automaton.states
    (transition,) = automaton.transitions
    assert (state.id, state.name, state.initial, state.x, state.y, state.children) == (
        1, "go to wall", True, 118.113, 121.0, ()
    )  # fmt: skip
    assert state.code.text == "\nself.motors.setV(0.2)\nif 1 < 2: pass"
    assert (transition.id, transition.origin, transition.destination) == (7, 1, 1)
    assert (transition.type, transition.trigger.text, automaton.iteration_time.text) == ("time", "1500", "50")
    assert [library.name.text for library in document.libraries] == ["numpy as np"]
    (interface,) = document.interfaces
    assert (interface.name, interface.identity, interface.type) == ("motors", "Motors", "Motors")
    assert (interface.ip, interface.port) == ("localhost", "9001")


def test_every_element_and_code_knows_its_place() -> None:
    automaton = parse(DOCUMENT).automata[0]
    state, transition = automaton.states[0], automaton.transitions[0]
    assert (automaton.line, state.line, transition.line) == (4, 6, 18)
    assert (state.column, state.code.line, state.code.column) == (5, 11, 13)
    assert (transition.trigger.line, transition.trigger.column) == (25, 26)


def test_the_place_of_code_that_begins_with_an_entity_or_in_cdata() -> None:
    text = (
        '<VisualHFSM><SubAutomata id="1"><state id="1"><name>\n&lt;</name>'
        "<code>&lt;</code></state>\n<state id='2'><code><![CDATA[x]]></code></state></SubAutomata></VisualHFSM>"
    )
    first, second = parse(text).automata[0].states
    assert (first.code.text, first.code.line, first.code.column) == ("<", 2, 18)
    assert (second.code.text, second.code.line, second.code.column) == ("x", 3, 30)


def test_writes_a_document_as_it_was() -> None:
    assert write_document(parse(DOCUMENT)) == DOCUMENT


def test_unknown_elements_attributes_and_comments_survive() -> None:
    document = parse(
        '<VisualHFSM version="9"><!-- a --><SubAutomata id="1" idFather="0" color="red">'
        '<state id="1" initial="true" x="y"><!-- b --><extra a="1"><b/></extra></state></SubAutomata>'
        "<future><deep>text</deep></future><libraries><other/></libraries>"
        "<config><ros/><iceinterface><nameinterface>m</nameinterface><servertype>2</servertype>"
        "<interface>Motors</interface></iceinterface></config></VisualHFSM>"
    )
    state = document.automata[0].states[0]
    assert document.attributes == (("version", "9"),)
    assert document.automata[0].comments == (Comment(" a "),)
    assert document.automata[0].attributes == (("color", "red"),)
    assert state.extras == (Comment(" b "), Element("extra", (("a", "1"),), "", (Element("b"),)))
    assert document.extras == (Element("future", (), "", (Element("deep", (), "text"),)),)
    assert document.interfaces[0].extras == (Element("servertype", (), "2"),)
    assert document.interfaces[0].proxy is None
    assert parse(write_document(document)) == document


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("<VisualHFSM>\n <a>\n</VisualHFSM>", "test.xml:3:3: malformed XML: mismatched tag"),
        ("", "test.xml:1:1: malformed XML: the file has no element"),
        ("<VisualHFSM>\n <a>", "test.xml:2:5: malformed XML: the element `a` of line 2 is not closed"),
        (b"\xff\xfe\x00<", "test.xml:1:2: malformed XML: not well-formed (invalid token)"),
        ("<html/>", "test.xml:1:1: `html` is not the root of a document: it must be `VisualHFSM`"),
    ],
)
def test_malformed_xml_is_reported_with_its_place(text: str | bytes, expected: str) -> None:
    assert errors(text) == [expected]


def test_entities_and_document_types_are_refused() -> None:
    bomb = '<!DOCTYPE a [<!ENTITY x "xxxx">]>\n<VisualHFSM>&x;</VisualHFSM>'
    (error,) = errors(bomb)
    assert "document types and entities are not allowed" in error


def test_a_document_deeper_than_any_that_a_person_makes_is_refused() -> None:
    (error,) = errors("<VisualHFSM>" + "<a>" * 100 + "</a>" * 100 + "</VisualHFSM>")
    assert "nested deeper than 64" in error


def test_a_document_larger_than_any_that_a_person_makes_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "big.xml"
    path.write_bytes(b" " * ((16 << 20) + 1))
    diagnostics = Diagnostics()
    assert read_document(path, diagnostics) is None
    assert "larger than 16 MiB" in diagnostics.render()


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    diagnostics = Diagnostics()
    assert read_document(tmp_path / "absent.xml", diagnostics) is None
    assert "No such file" in diagnostics.render()


def test_all_faults_are_reported_in_one_run() -> None:
    found = errors(
        "<VisualHFSM>\n"
        "<SubAutomata id='x'>\n"
        "<state id='1' initial='maybe'>\n"
        "<posx>left</posx>\n"
        "<code/><code/></state>\n"
        "<transition id='1'><origin>1</origin><destiny>one</destiny></transition>\n"
        "</SubAutomata></VisualHFSM>"
    )
    assert [error.split(": ", 1)[0] for error in found] == [
        "test.xml:2:1", "test.xml:3:1", "test.xml:4:1", "test.xml:5:8", "test.xml:6:38",
    ]  # fmt: skip
    assert "not `x`" in found[0]
    assert "`true` or `false`" in found[1]
    assert "a second `code`" in found[3]


def warnings(text: str | bytes) -> list[str]:
    diagnostics = Diagnostics()
    assert parse_document(text, PATH, diagnostics) is not None, diagnostics.render()
    return [f"{found.code} {found.location}: {found.message}" for found in diagnostics]


def test_who_has_no_id_is_given_a_free_one_and_that_is_reported() -> None:
    text = "<VisualHFSM><SubAutomata id='1'><state id='1'/><state id=' '/><state/></SubAutomata></VisualHFSM>"
    assert [state.id for state in parse(text).automata[0].states] == [1, 2, 3]
    assert [warning.split(":")[0] for warning in warnings(text)] == ["W502 test.xml"] * 2


@pytest.mark.parametrize(
    ("trigger", "expected", "code"),
    [
        ("", ("condition", ""), None),
        ("<trans> 500 </trans>", ("time", " 500 "), "W507"),
        ("<trans>a &lt; b</trans>", ("condition", "a < b"), "W507"),
        ("<trans/>", ("condition", ""), "W507"),
        ("<trans type='later'>x</trans>", ("later", "x"), None),
    ],
)
def test_a_transition_that_does_not_say_when_it_fires_is_read(
    trigger: str, expected: tuple[str, str], code: str | None
) -> None:
    inside = f"<transition id='1'><origin>1</origin><destiny>1</destiny>{trigger}</transition>"
    text = f"<VisualHFSM><SubAutomata id='1'>{inside}</SubAutomata></VisualHFSM>"
    (transition,) = parse(text).automata[0].transitions
    assert (transition.type, transition.trigger.text) == expected
    assert [warning.split()[0] for warning in warnings(text)] == ([code] if code else [])


def test_a_comma_in_a_number_is_understood_and_reported() -> None:
    text = (
        "<VisualHFSM><SubAutomata id='1'><state id='1'><posx> 1,5 </posx></state></SubAutomata></VisualHFSM>"
    )
    assert parse(text).automata[0].states[0].x == 1.5
    assert [warning.split(":")[0] for warning in warnings(text)] == ["W503 test.xml"]


@OLD_DOCUMENTS
@pytest.mark.parametrize(
    "text",
    [
        "<VisualHFSM>\n<?php x?>\n</VisualHFSM>",
        "<VisualHFSM><SubAutomata id='1'>lost</SubAutomata></VisualHFSM>",
        "<VisualHFSM><SubAutomata id='1'><functions>a<!-- lost -->b</functions></SubAutomata></VisualHFSM>",
        "<VisualHFSM><libraries><lib>a<lost/>b</lib></libraries></VisualHFSM>",
        "<VisualHFSM><unknown>a<lost/>b</unknown></VisualHFSM>",
        "<VisualHFSM><SubAutomata id='1'><variables lost='a'>x = 1</variables></SubAutomata></VisualHFSM>",
        "<VisualHFSM><SubAutomata id='1'><state id='1'><child lost='a'>1</child></state></SubAutomata></VisualHFSM>",
    ],
)
def test_what_cannot_be_kept_is_reported(text: str) -> None:
    (warning,) = [each for each in warnings(text) if not each.startswith("W541")]
    assert warning.startswith("W501")


AUTOMATON = "<SubAutomata id='1' idFather='0'>\n{}</SubAutomata>"
STATE = AUTOMATON.format("<state id='1' initial='true'><name>a</name>{}</state>")


@OLD_DOCUMENTS
@pytest.mark.parametrize(
    ("inside", "message", "note"),
    [
        (STATE.format("<exitt>x</exitt>"), "`exitt` means nothing in `state`", "did you mean `exit`?"),
        (AUTOMATON.format("<State id='1'/>"), "`State` means nothing in `SubAutomata`", "did you mean `state`?"),
        ("<interfaces><interface/></interfaces>", "`interfaces` means nothing in `VisualHFSM`", None),
        (STATE.format("<guard>x</guard>"), "`guard` means nothing in `state`", "it belongs into `transition`"),
        ("<iceinterface/>", "`iceinterface` means nothing in `VisualHFSM`", "it belongs into `config`"),
        ("<library>cv2</library>", "`library` means nothing in `VisualHFSM`", "did you mean `libraries`?"),
        (STATE.format("<shape/>"), "`shape` means nothing in `state`", None),
        (STATE.replace("initial", "initiall").format(""), "`state` has no attribute `initiall`", "did you mean `initial`?"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("separator", ["\n", ""], ids=["lines", "one line"])
def test_what_means_nothing_is_reported_wherever_it_stands(
    inside: str, message: str, note: str | None, separator: str
) -> None:
    text = f"<VisualHFSM>{separator}{inside}</VisualHFSM>".replace("\n", separator)
    diagnostics = Diagnostics()
    assert parse_document(text, Path("test.xml"), diagnostics) is not None
    (found,) = [each for each in diagnostics if each.code == "W541"]
    assert found.message == f"{message}: it is kept, but not used"
    assert [each.message for each in found.notes] == ([] if note is None else [note])


def test_what_other_programs_keep_in_a_document_is_not_reported() -> None:
    own = STATE.format("<lab:score>1</lab:score>")
    assert warnings(f"<VisualHFSM note='1'>{own}</VisualHFSM>") == []


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_conflict_of_a_merge_is_named(newline: str) -> None:
    lines = ["<VisualHFSM>", "<<<<<<< HEAD", "<a/>", "=======", "<b/>", ">>>>>>> theirs", "</VisualHFSM>"]
    diagnostics = Diagnostics()
    assert parse_document(newline.join(lines).encode(), Path("test.xml"), diagnostics) is None
    (error,) = diagnostics.errors
    assert (error.code, error.location.line, error.location.column) == ("E502", 2, 1)
    assert error.message == "`<<<<<<<` begins a conflict of a merge: keep one of the two versions"


@pytest.mark.parametrize(
    "inside",
    [
        "<!-- kept --><name>a</name>",
        "<name>a</name><!-- kept -->",
        "<!-- kept --><argument name='a' b='c'>1</argument>",
    ],
)
def test_comments_in_a_node_and_attributes_of_nodes_survive(inside: str) -> None:
    text = f"<VisualHFSM><SubAutomata id='1'><state id='1'>{inside}</state></SubAutomata></VisualHFSM>"
    document = parse(text)
    written = write_document(document)
    assert parse(written) == document
    assert written.count("<!-- kept -->") == 1
    assert ('<argument name="a" b="c">1</argument>' in written) == ("argument" in inside)


def test_a_comment_before_a_value_is_kept_at_the_end_of_its_node() -> None:
    text = "<VisualHFSM><!-- slow --><config/><SubAutomata id='1'><!-- a --><state id='1'><!-- b --><name>n</name>"
    document = parse(f"{text}</state></SubAutomata></VisualHFSM>")
    (automaton,) = document.automata
    assert (document.extras, automaton.states[0].comments, automaton.states[0].extras) == (
        (Comment(" slow "),),
        (Comment(" a "),),
        (Comment(" b "),),
    )


def test_comments_and_attributes_of_lists_survive() -> None:
    document = parse(
        "<VisualHFSM><!-- p --><parameters a='1'><other/></parameters><!-- l --><libraries b='2'/>"
        "<!-- c --><config type='1'><!-- end --></config></VisualHFSM>"
    )
    written = write_document(document)
    assert parse(written) == document
    for piece in ("<!-- p -->", '<parameters a="1">', "<!-- l -->", '<libraries b="2"/>', "<!-- end -->"):
        assert piece in written


@settings(max_examples=examples(25), deadline=None)
@given(st.binary(max_size=200) | any_text(max_size=200).map(str.encode))
def test_no_input_does_more_than_report_errors(content: bytes) -> None:
    diagnostics = Diagnostics()
    assert parse_document(content, PATH, diagnostics) is None
    assert diagnostics.has_errors
