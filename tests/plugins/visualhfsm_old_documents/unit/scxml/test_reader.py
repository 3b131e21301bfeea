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
from tests.support.any_text import any_text
from tests.support.documents import compile_to, load
from tests.support.examples import examples
from tests.support.scxml_documents import TURNS, export, facts, import_, one_automaton, parse, scxml
from tests.support.scxml_rules import violations


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


AB = '<state id="a">{}</state><state id="b"/>'


FOREIGN = {
    "events, conditions and both": (
        AB.format(
            '<transition event="e" target="b"/><transition cond="x &gt; 1" target="b"/>'
            '<transition event="f g" cond="x == 1" target="b"/><transition target="a"/>'
        ),
        [
            (
                "1/0: *a b; a->b event:e; a->b condition:x > 1; a->b event:f [x == 1]; "
                "a->b event:g [x == 1]; a->a condition:True"
            )
        ],
        [],
    ),
    "a timer as in Qt": (
        AB.format(
            '<onentry><send event="late" delay="3s" id="t"/></onentry><onexit><cancel sendid="t"/></onexit>'
            '<transition event="late" target="b"/>'
        ),
        ["1/0: *a b; a->b time:3000"],
        [],
    ),
    "a delayed event that is never cancelled": (
        AB.format(
            '<onentry><send event="after.a" delay="1s"/></onentry><transition event="after.a" target="b"/>'
        ),
        ["1/0: *a b; a->b time:1000"],
        ["N561"],
    ),
    "a timer that a transition cancels, in a region": (
        (
            '<parallel id="p"><state id="r"><onentry><send event="late" id="t" delayexpr="\'2s\'"/></onentry>'
            '<transition event="late" target="a"/><transition event="hurry" target="a"><cancel sendid="t"/></transition>'
            '</state></parallel><state id="a"/>'
        ),
        [
            "1/0: *p<2(restart) a; p->a event:leave p for a",
            (
                "2/1: *r leave p for a; r->leave p for a time:2000 {self.send('leave p for a')}; "
                "r->leave p for a event:hurry {self.send('leave p for a')}"
            ),
        ],
        ["N561", "N561"],
    ),
    "a delayed event that is cancelled while the state goes on": (
        AB.format(
            '<onentry><send event="late" delay="3s" id="t"/></onentry><transition event="late" target="b"/>'
            '<transition event="calm"><cancel sendid="t"/></transition>'
        ),
        ["1/0: *a b; a->b event:late"],
        ["W561", "W561"],
    ),
    "a delayed event that is cancelled by a transition that stays": (
        (
            '<state id="a"><onentry><send event="late" delay="3s" id="t"/></onentry><transition event="late" target="b"/>'
            '<transition event="calm" type="internal" target="x"><cancel sendid="t"/></transition><state id="x"/></state>'
            '<state id="b"/>'
        ),
        ["1/0: *a<2(restart) b; a->b event:late; a->a event:calm", "2/1: *x"],
        ["W561", "W561", "W562"],
    ),
    "a delayed event without a name, and any event": (
        AB.format('<onentry><send eventexpr="x" delay="3s"/></onentry><transition event="*" target="b"/>'),
        ["1/0: *a b"],
        ["W561", "W561"],
    ),
    "a timer of a state, and of what it invokes": (
        AB.format(
            '<invoke><content><scxml><state id="c"><onentry><send event="late" delay="1s"/></onentry>'
            '<transition event="late" target="c"/></state></scxml></content></invoke>'
            '<onentry><send event="late" delay="3s"/></onentry><transition event="late" target="b"/>'
        ),
        ["1/0: *a b; a->b time:3000"],
        ["N561", "W561"],
    ),
    "a delayed event whose first word somebody else awaits": (
        AB.format(
            '<onentry><send event="late.a" delay="3s"/></onentry><transition event="late.a" target="b"/>'
        ).replace('<state id="b"/>', '<state id="b"><transition event="late.*" target="a"/></state>'),
        ["1/0: *a b; a->b event:late.a; b->a event:late"],
        ["W561", "W562"],
    ),
    "code with which a history or a state inside starts": (
        (
            '<state id="a"><history id="h"><transition target="x"><raise event="e"/></transition></history><state id="x">'
            '<initial><transition target="y"><raise event="f"/></transition></initial><history id="i"><transition target="y">'
            '<raise event="g"/></transition></history><state id="y"/></state></state>'
        ),
        ["1/0: *a<2", "2/1: *x<3", "3/2: *y"],
        ["W561", "W561", "W561", "W562"],
    ),
    "a state that resumes since it begins with its history": (
        (
            '<state id="o"><transition event="go" target="a"/><transition event="x" target="x"/></state><state id="a" initial="h">'
            '<history id="h" type="deep"><transition target="x"/></history><state id="x"/><state id="y"/></state>'
        ),
        ["1/0: *o a<2; o->a event:go; o->a event:x", "2/1: *x y"],
        ["W562"],  # of the transition into a state inside
    ),
    "what no SCXML has, and data inside": (
        (
            '<datamodel><value/><data id="d"><book/></data></datamodel><state id="a" intial="b">'
            '<transition event="e" target="a" conde="1"/></state>'
        ),
        ["1/0: *a; a->a event:e"],
        ["W561", "W561", "W561", "W561"],
    ),
    "a timer whose event is also sent": (
        AB.format(
            '<onentry><send event="late" delay="3s" id="t"/></onentry><onexit><cancel sendid="t"/></onexit>'
            '<transition event="late" target="b"/><transition event="hurry" target="a"><raise event="late"/></transition>'
        ),
        ['1/0: *a b; a->b event:late; a->a event:hurry {self.send("late")}'],
        ["W561", "W561"],
    ),
    "a delayed event for somebody else": (
        (
            '<state id="a"><onentry><send event="t" delay="1s"/></onentry><transition event="go" target="b"/></state>'
            '<state id="b"><transition event="t" target="a"/></state>'
        ),
        ["1/0: *a b; a->b event:go; b->a event:t"],
        ["W561"],
    ),
    "a delayed event for the state and others": (
        AB.format(
            '<onentry><send event="t" delay="1s"/></onentry><transition event="t" target="b"/>'
        ).replace('<state id="b"/>', '<state id="b"><transition event="t" target="a"/></state>'),
        ["1/0: *a b; a->b event:t; b->a event:t"],
        ["W561"],
    ),
    "regions inside regions": (
        '<parallel id="p"><parallel id="q"><state id="r"/><state id="s"/></parallel><state id="t"/></parallel>',
        ["1/0: *p<2<5(restart)", "2/1: *q<3<4(restart)", "3/2: *r", "4/2: *s", "5/1: *t"],
        [],
    ),
    "states inside, history and an end": (
        (
            '<state id="on"><initial><transition target="q"/></initial><history id="h"><transition target="p"/></history>'
            '<transition event="off" target="o"/><transition event="done.state.on" target="o"/>'
            '<state id="p"><transition event="n" target="q"/></state><state id="q"><transition event="n" target="r"/></state>'
            '<final id="r"/></state><state id="o"><transition event="on" target="h"/></state>'
        ),
        [
            "1/0: *on<2 o; on->o event:off; on->o finished:; o->on event:on",
            "2/1: p *q r!; p->q event:n; q->r event:n",
        ],
        ["W562"],  # the history begins elsewhere than the state
    ),
    "parallel regions, one with an entry": (
        (
            '<parallel id="p"><state id="r1"><state id="x"><transition event="e" target="y"/></state><state id="y"/></state>'
            '<state id="r2"><onentry><raise event="e"/></onentry></state></parallel>'
        ),
        ["1/0: *p<2<3(restart)", "2/1: *x y; x->y event:e", "3/1: *r2"],
        [],
    ),
    "a state that begins further inside": (
        '<state id="a" initial="z"><state id="x"/><state id="y"><state id="w"/><state id="z"/></state></state>',
        ["1/0: *a<2(restart)", "2/1: x *y<3(restart)", "3/2: w *z"],
        [],
    ),
    "a state that begins further inside than where that says": (
        '<state id="a" initial="y"><state id="x" initial="w"><state id="w"/><state id="y"/></state></state>',
        ["1/0: *a<2(restart)", "2/1: *x<3(restart)", "3/2: *w y"],
        ["W562"],
    ),
    "transitions into two states inside": (
        (
            '<state id="a"><transition event="e" target="y"/><transition event="f" target="b"/></state>'
            '<state id="b"><state id="x"/><state id="y"/></state>'
        ),
        ["1/0: *a b<2(restart); a->b event:e; a->b event:f", "2/1: *x y"],
        ["W562"],
    ),
    "a transition out of a state from inside": (
        (
            '<state id="a"><state id="x"><transition event="e" target="b"><log label="bye"/></transition></state></state>'
            '<state id="b"/>'
        ),
        [
            "1/0: *a<2(restart) b; a->b event:leave a for b",
            (
                "2/1: *x leave a for b; x->leave a for b event:e "
                '{self.log.info("%s", "bye")\nself.send(\'leave a for b\')}'
            ),
        ],
        ["N561"],
    ),
    "a state that resumes, and is also restarted": (
        (
            '<state id="a"><history id="h" type="deep"><transition target="x"/></history><state id="x"/>'
            '<state id="y"><transition event="out" target="b"/></state></state>'
            '<state id="b"><transition event="on" target="h"/><transition event="restart" target="a"/></state>'
        ),
        [
            "1/0: *a<2 b; a->b event:leave a for b; b->a event:on; b->a event:restart",
            (
                "2/1: *x y leave a for b from y; y->leave a for b from y event:out {self.send('leave a for b')}; "
                "leave a for b from y->y time:200"
            ),
        ],
        ["W562", "N561"],
    ),
    "histories that are shallow, and two": (
        (
            '<state id="a"><history id="h"><transition target="x"/></history><history id="i"><transition target="x"/></history>'
            '<state id="x"><state id="y"/></state></state>'
        ),
        ["1/0: *a<2", "2/1: *x<3(restart)", "3/2: *y"],
        ["W562", "W562"],
    ),
    "a state that begins with its own history": (
        (
            '<state id="a"><initial><transition target="h"/></initial><history id="h" type="deep">'
            '<transition target="y"/></history><state id="x"/><state id="y"/></state>'
        ),
        ["1/0: *a<2", "2/1: x *y"],
        [],
    ),
    "a transition of a final state": (
        '<final id="a"><transition event="e" target="a"/></final>',
        ["1/0: *a!"],
        ["W561"],
    ),
    "a transition inside without leaving": (
        '<state id="a"><transition event="e" type="internal" target="y"/><state id="x"/><state id="y"/></state>',
        ["1/0: *a<2(restart); a->a event:e", "2/1: *x y"],
        ["W562", "W562"],
    ),
    "what there is not here": (
        (
            '<state id="a"><invoke src="b.scxml"/><transition event="e"><assign location="x" expr="1"/></transition>'
            '<transition event="*" target="a"/><transition event="error.execution" target="a"/>'
            '<transition event="f.*" target="a"/><onexit><script src="x.js"/></onexit></state>'
        ),
        ["1/0: *a; a->a event:f"],
        ["W561", "W561", "W561", "W561", "W562", "W561"],
    ),
    "code with branches": (
        AB.format(
            '<transition event="e" target="b"><if cond="x &gt; 1"><raise event="f"/><elseif cond="x == 1"/>'
            '<assign location="x" expr="x + 1"/><else/></if><log expr="x"/>'
            '<send event="g"><param name="v" expr="x"/></send></transition>'
        ),
        [
            (
                '1/0: *a b; a->b event:e {if x > 1:\n    self.send("f")\nelif x == 1:\n    x = x + 1\nelse:\n'
                '    pass\nself.log.info("%s %s", "", x)\nself.send("g", {"v": x})}'
            )
        ],
        [],
    ),
}


@pytest.mark.parametrize(("inside", "expected", "codes"), FOREIGN.values(), ids=FOREIGN.keys())
def test_scxml_of_others_is_carried_as_far_as_it_goes(
    inside: str, expected: list[str], codes: list[str]
) -> None:
    document, diagnostics = import_(scxml(inside, ' datamodel="python"'))
    assert document is not None, diagnostics.render()
    assert facts(document) == expected
    assert sorted(found.code for found in diagnostics) == sorted(codes), diagnostics.render()
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


_SEEDS = [export(parse(TURNS))[0], *(scxml(inside) for inside, _, _ in FOREIGN.values())]


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
