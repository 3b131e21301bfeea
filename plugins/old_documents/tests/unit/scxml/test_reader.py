"""SCXML that other programs have changed or written is read as far as it goes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.hfsm import write_document
from codegen.hfsm.document import Document
from codegen.hfsm.formats.others import imported_format, writable_formats
from hfsm_runtime import VirtualRun, run
from plugins.old_documents.tests.support.scxml_documents import (
    TURNS,
    export,
    facts,
    import_,
    one_automaton,
    parse,
    scxml,
)
from plugins.old_documents.tests.support.scxml_rules import violations
from tests.support.any_text import any_text
from tests.support.documents import compile_to, load
from tests.support.examples import examples


def changed(old: str, new: str, document: str = TURNS) -> Document:
    text, _ = export(parse(document))
    assert old in text
    document_, diagnostics = import_(text.replace(old, new))
    assert document_ is not None, diagnostics.render()
    assert "W561" in [found.code for found in diagnostics]
    return document_


def test_what_scxml_says_counts_when_it_was_changed() -> None:
    renamed = changed('event="tired"', 'event="exhausted"')
    assert renamed.automata[0].transitions[0].trigger.text == "exhausted"
    moved = changed('event="next" target="walk"', 'event="next" target="over"')
    assert moved.automata[2].transitions[0].destination == 3
    begins = changed('initial="coffee"', 'initial="walk"').automata[2]
    assert [state.initial for state in begins.states] == [False, True, False]
    timed = one_automaton('<transition id="1"><origin>1</origin><destiny>2</destiny><trans type="time"> 500 </trans></transition>')  # fmt: skip
    assert changed('delay="500ms"', 'delay="2s"', timed).automata[0].transitions[0].trigger.text == "2000"


def test_a_part_that_was_deleted_is_gone() -> None:
    document = changed('<transition event="tired" target="break" />', "")
    assert "tired" not in [each.trigger.text for each in document.automata[0].transitions]
    assert len(document.automata[0].transitions) == 2


def test_a_native_document_that_was_broken_is_an_error() -> None:
    text, _ = export(parse(TURNS))
    document, diagnostics = import_(text.replace("<VisualHFSM>", "<VisualHFSM><", 1))
    assert document is None
    assert [found.location.line for found in diagnostics.errors] == [3]


def test_a_state_and_a_transition_that_were_added_are_carried() -> None:
    document = changed(
        '<state id="test">',
        '<state id="rest"><transition event="tired" target="write"/></state><state id="test">',
    )
    automaton = document.automata[1]
    assert [(state.id, state.name) for state in automaton.states] == [(1, "write"), (2, "rest"), (3, "test")]
    assert (automaton.transitions[1].origin, automaton.transitions[1].destination) == (2, 1)


def test_an_order_that_was_changed_counts() -> None:
    transitions = "".join(
        f'<transition id="{number}"><origin>1</origin><destiny>2</destiny><trans type="event">e{number}</trans><priority>{number}</priority></transition>'
        for number in (1, 2)
    )
    text, _ = export(parse(one_automaton(transitions)))
    first, second = re.findall(r"    <transition event=[^>]*/>\n", text)
    document, _ = import_(text.replace(first + second, second + first))
    assert document is not None
    assert [each.trigger.text for each in document.automata[0].outgoing(1)] == ["e2", "e1"]


FOREIGN = sorted((Path(__file__).parents[2] / "data" / "scxml").iterdir())
"""What other programs write; the comment before it says what is reported of it, and what it becomes."""


@pytest.mark.parametrize("path", FOREIGN, ids=lambda path: path.stem)
def test_scxml_of_others_is_carried_as_far_as_it_goes(path: Path) -> None:
    text = path.read_text("utf-8")
    codes, expected = text.removeprefix("<!-- reported:").partition("\n-->")[0].split("\n", 1)
    document, diagnostics = import_(text)
    assert document is not None, diagnostics.render()
    assert "\n".join(facts(document)) == expected
    assert sorted(found.code for found in diagnostics) == sorted(codes.split()), diagnostics.render()
    assert parse(write_document(document)) == document


def test_a_document_with_code_of_another_language_says_so() -> None:
    inside = (
        '<datamodel><data id="x" expr="0"/></datamodel><state id="a"><onentry><script>x++;</script></onentry>'
        '<transition event="e" cond="x === 1 &amp;&amp; true" target="a"/></state>'
    )
    foreign, found = import_(scxml(inside))
    assert foreign is not None
    assert (foreign.language.text, foreign.automata[0].states[0].entry.text) == ("ECMAScript", "x++;")
    assert foreign.automata[0].variables.text == "x = 0"
    assert facts(foreign) == ["1/0: *a; a->a event:e [x === 1 && true]"]
    assert [each.code for each in found] == ["N502"] * 3
    assert import_(export(foreign)[0])[0] == foreign
    python, diagnostics = import_(
        scxml('<state id="a"><onentry><script>x = y[0]</script></onentry></state>', ' datamodel="python"')
    )
    assert python is not None
    assert (python.language.text, list(diagnostics)) == ("", [])


@pytest.mark.parametrize("name", ["In('b')", "_event.data", "_sessionid"])
def test_names_that_only_interpreters_of_scxml_have_are_reported(name: str) -> None:
    inside = f'<state id="a"><transition event="e" cond="{name}" target="b"/></state><state id="b"/>'
    _, diagnostics = import_(scxml(inside, ' datamodel="python"'))
    assert [found.code for found in diagnostics] == ["W561"]
    assert name.partition("(")[0].partition(".")[0] in diagnostics.render()


def test_data_becomes_variables_and_their_use_elsewhere_is_reported() -> None:
    inside = '<datamodel><data id="n" expr="0"/><data id="l">[1]</data></datamodel><state id="a"><state id="b">{}</state></state>'
    document, diagnostics = import_(scxml(inside.format(""), ' datamodel="python"'))
    assert document is not None
    assert document.automata[0].variables.text == "n = 0\nl = [1]"
    assert not len(diagnostics)
    _, diagnostics = import_(
        scxml(inside.format("<onentry><script>n += 1</script></onentry>"), ' datamodel="python"')
    )
    assert [found.code for found in diagnostics] == ["W562"]


def test_events_that_come_from_outside_are_declared() -> None:
    inside = (
        '<parallel id="p"><state id="r1"><state id="x"><onentry><raise event="own"/></onentry>'
        '<transition event="own go" target="x"/></state></state></parallel>'
    )
    document, _ = import_(scxml(inside, ' name="Robot"'))
    assert document is not None
    assert [event.name for event in document.events] == ["go"]
    assert document.description.text == "Robot"


def test_events_that_are_raised_in_a_row_keep_their_order(tmp_path: Path) -> None:
    inside = (
        '<state id="s0"><onentry><raise event="foo"/><raise event="bar"/></onentry>'
        '<transition event="bar" target="fail"/><transition event="foo" target="s1"/></state>'
        '<state id="s1"><transition event="bar" target="pass"/></state><state id="pass"/><state id="fail"/>'
    )
    document, diagnostics = import_(scxml(inside, ' datamodel="python"'))
    assert document is not None
    assert list(diagnostics) == []
    component = load(compile_to(tmp_path, write_document(document)))
    assert run(component, 1).active == "pass"


@pytest.mark.parametrize("end", ["", '<transition event="done.state.a" target="b"/>'])
def test_a_state_that_was_left_from_inside_goes_on_there(tmp_path: Path, end: str) -> None:
    inside = (
        f'<state id="a">{end}<history id="h" type="deep"><transition target="m"/></history>'
        '<state id="m"><state id="x"><transition event="go" target="y"/></state>'
        '<state id="y"><transition event="out" target="b"/></state></state></state>'
        '<state id="b"><transition event="back" target="h"/></state>'
    )
    document, _ = import_(scxml(inside, ' datamodel="python"'))
    assert document is not None
    virtual = VirtualRun(load(compile_to(tmp_path, write_document(document))))
    for event, active in (("go", "a/m/y"), ("out", "b"), ("back", "a/m/y"), ("out", "b")):
        virtual.component.send(event)
        virtual.advance(1)
        assert virtual.active == active


def test_data_inside_belongs_to_the_automaton_inside() -> None:
    data = '<datamodel><data id="{}" expr="1"/></datamodel>'
    inside = f'<state id="a">{data.format("m")}<state id="b">{data.format("n")}</state></state>'
    document, _ = import_(scxml(inside))
    assert document is not None
    assert [automaton.variables.text for automaton in document.automata] == ["", "m = 1\nn = 1"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<html/>", "not the root of SCXML"),
        (scxml('<state id="a"/><state id="a"/>'), "second element has the id"),
        (scxml('<state id="work"><transition target="wrk"/></state>'), "no state has the id"),
        (scxml('<state id="a"/>', ' initial="b"'), "no state has the id"),
        (scxml('<state id="a" initial="b"><state id="c"/></state><state id="b"/>'), "not inside"),
    ],
)
def test_what_is_no_scxml_is_refused(text: str, message: str) -> None:
    document, diagnostics = import_(text)
    assert document is None
    assert [found.code for found in diagnostics.errors] == ["E561"]
    assert message in diagnostics.render()


def test_every_finding_has_its_line() -> None:
    text = scxml('\n<state id="a">\n<invoke/>\n<transition event="*" target="a"/>\n</state>')
    _, diagnostics = import_(text)
    assert [found.location.line for found in diagnostics] == [3, 4]


def test_namespaces_count_and_not_prefixes() -> None:
    text = (
        '<s:scxml xmlns:s="http://www.w3.org/2005/07/scxml" xmlns="urn:other" version="1.0">'
        '<s:state id="a"/><state id="b"/></s:scxml>'
    )
    document, diagnostics = import_(text)
    assert document is not None
    assert facts(document) == ["1/0: *a"]
    assert [found.code for found in diagnostics] == ["N562"]


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        (b"<scxml>", True),
        (b'\xef\xbb\xbf<?xml version="1.0"?>\n<!-- <VisualHFSM> --><sc:scxml xmlns:sc="x">', True),
        (b"<VisualHFSM><scxml/>", False),
        (b"<!-- <scxml> --><VisualHFSM>", False),
        (b"<scxmlish>", False),
    ],
)
def test_scxml_is_known_by_its_name_or_root(head: bytes, expected: bool) -> None:
    assert imported_format("a.xml", head) == (writable_formats()[".scxml"] if expected else None)
    assert imported_format("a.SCXML", head) == writable_formats()[".scxml"]


_SEEDS = [export(parse(TURNS))[0], *(path.read_text("utf-8").partition("-->\n")[2] for path in FOREIGN)]


_PIECES = st.sampled_from(
    [
        *('id="a"', 'target="b a"', 'initial="h"', 'event="done.state.a e.* *"', 'type="internal"', 'cond="("'),
        *('delay="x"', 'hfsm:index="-1"', 'xmlns="urn:x"', "<state/>", "<history/>", "<final/>", "<!-- - -->", "<parallel>"),
        *("</state>", "<initial/>", '<hfsm:SubAutomata id="x"/>', "<hfsm:native-state/>", "<if/>", "text", "&lt;", "_x0000_"),
    ]
)  # fmt: skip


@settings(max_examples=examples(30), deadline=None)
@given(st.sampled_from(_SEEDS), st.data())
def test_no_file_does_more_than_bring_errors(seed: str, data: st.DataObject) -> None:
    tokens = re.findall(r"<[^>]*>|[^<]+", seed)
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(tokens) - 1))
        match data.draw(st.sampled_from(["drop", "double", "swap", "put", "attribute"])):
            case "drop":
                tokens[place] = ""
            case "double":
                tokens[place] *= 2
            case "swap":
                other = data.draw(st.integers(0, len(tokens) - 1))
                tokens[place], tokens[other] = tokens[other], tokens[place]
            case "put":
                tokens.insert(place, data.draw(_PIECES))
            case "attribute":
                tokens[place] = re.sub(r' \w+="[^"]*"', " " + data.draw(_PIECES), tokens[place], count=1)
    document, diagnostics = import_("".join(tokens))
    assert (document is None) == diagnostics.has_errors
    if document is not None:
        assert parse(write_document(document)) == document
        assert violations(export(document)[0]) == []
        assert import_(export(document)[0])[0] == document


@settings(max_examples=examples(20), deadline=None)
@given(st.binary(max_size=200) | any_text(max_size=200).map(str.encode))
def test_what_is_no_xml_is_reported(content: bytes) -> None:
    document, diagnostics = import_(content)
    assert document is None
    assert diagnostics.has_errors
