"""SCXML: the output conforms to the recommendation, and is read back as the same document."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, read_document, write_document
from codegen.hfsm.document import Automaton, Document, State, Text, Transition
from codegen.hfsm.scxml import is_scxml, parse_scxml, write_scxml
from hfsm_runtime import VirtualRun, run
from tests.support.any_text import any_text
from tests.support.codegen_command import ROOT
from tests.support.documents import compile_to, load
from tests.support.examples import examples
from tests.support.pages import DOCS
from tests.support.random_documents import documents, trees
from tests.support.scxml_rules import violations

PATH = Path("test.xml")


def parse(text: str) -> Document:
    diagnostics = Diagnostics()
    document = parse_document(text, PATH, diagnostics)
    assert document is not None, diagnostics.render()
    return document


def export(document: Document) -> tuple[str, Diagnostics]:
    diagnostics = Diagnostics()
    return write_scxml(document, PATH, diagnostics), diagnostics


def import_(text: str) -> tuple[Document | None, Diagnostics]:
    diagnostics = Diagnostics()
    return parse_scxml(text, Path("test.scxml"), diagnostics), diagnostics


@settings(max_examples=examples(20), deadline=None)
@given(trees)
def test_a_document_of_any_shape_comes_back_as_it_was(document: Document) -> None:
    text, _ = export(document)
    again, diagnostics = import_(text)
    assert again == document, diagnostics.render()
    assert violations(text) == []


@settings(max_examples=examples(15), deadline=None)
@given(documents)
def test_whatever_is_in_a_document_comes_back_as_it_was(document: Document) -> None:
    text, _ = export(document)
    again, diagnostics = import_(text)
    assert again == document, diagnostics.render()
    assert violations(text) == []


# What stands for what.

TURNS = """<VisualHFSM>
  <SubAutomata id="1" idFather="0">
    <state id="1" initial="true"><name>work</name><idSubautomataSon>2</idSubautomataSon></state>
    <state id="2"><name>break</name><idSubautomataSon>3</idSubautomataSon><history>restart</history></state>
    <transition id="1"><origin>1</origin><destiny>2</destiny><trans type="event">tired</trans></transition>
    <transition id="2"><origin>2</origin><destiny>1</destiny><trans type="event">go on</trans></transition>
    <transition id="3"><origin>2</origin><destiny>1</destiny><trans type="finished"/></transition>
  </SubAutomata>
  <SubAutomata id="2" idFather="1">
    <state id="1" initial="true"><name>write</name></state>
    <state id="2"><name>test</name></state>
    <transition id="1"><origin>1</origin><destiny>2</destiny><trans type="event">next</trans></transition>
    <transition id="2"><origin>2</origin><destiny>1</destiny><trans type="event">next</trans></transition>
  </SubAutomata>
  <SubAutomata id="3" idFather="1">
    <state id="1" initial="true"><name>coffee</name></state>
    <state id="2"><name>walk</name></state>
    <state id="3"><name>over</name><final>true</final></state>
    <transition id="1"><origin>1</origin><destiny>2</destiny><trans type="event">next</trans></transition>
    <transition id="2"><origin>2</origin><destiny>3</destiny><trans type="event">next</trans></transition>
  </SubAutomata>
</VisualHFSM>
"""


def element(text: str, path: str) -> ET.Element:
    found = ET.fromstring(text.encode()).find(path, {"": "http://www.w3.org/2005/07/scxml"})
    assert found is not None, path
    return found


def one_automaton(inside: str) -> str:
    """Return a document with the states 1 and 2, a and b, and more."""
    return (
        '<VisualHFSM><SubAutomata id="1" idFather="0"><state id="1" initial="true"><name>a</name></state>'
        f'<state id="2"><name>b</name></state>{inside}</SubAutomata></VisualHFSM>'
    )


@pytest.mark.parametrize(
    ("milliseconds", "delay"), [("8000", "8000ms"), ("500", "500ms"), (" 1.50 ", "1.50ms")]
)
def test_a_transition_by_time_is_an_event_that_its_state_sends_itself(milliseconds: str, delay: str) -> None:
    trigger = f'<trans type="time">{milliseconds}</trans><guard>x &lt; 1</guard>'
    text, _ = export(parse(one_automaton(f'<transition id="7"><origin>1</origin><destiny>2</destiny>{trigger}</transition>')))  # fmt: skip
    send = element(text, ".//state[@id='a']/onentry/send")
    transition = element(text, ".//state[@id='a']/transition")
    assert send.get("delay") == delay
    assert transition.attrib == {"event": send.get("event"), "cond": "x < 1", "target": "b"}
    assert element(text, ".//state[@id='a']/onexit/cancel").get("sendid") == send.get("id")


def test_the_order_of_transitions_is_that_of_their_priorities() -> None:
    transitions = "".join(
        f'<transition id="{number}"><origin>1</origin><destiny>2</destiny><trans type="event">e{number}</trans>{more}</transition>'
        for number, more in ((1, ""), (2, "<priority>2</priority>"), (3, "<priority>1</priority>"))
    )
    text, _ = export(parse(one_automaton(transitions)))
    assert re.findall(r'event="(\w+)"', text) == ["e3", "e2", "e1"]


def test_states_inside_states_resume_by_their_history_or_restart() -> None:
    text, _ = export(parse(TURNS))
    work = element(text, "state[@id='work']")
    history = element(text, "state[@id='work']/history")
    assert (work.get("initial"), history.get("type")) == ("write", "deep")
    assert element(text, "state[@id='work']/history/transition").get("target") == "write"
    targets = [
        item.get("target") for item in ET.fromstring(text).iterfind("{*}state[@id='break']/{*}transition")
    ]
    assert targets == [history.get("id")] * 2
    assert "<history" not in text.partition('<state id="break"')[2]


def test_several_automata_of_a_state_are_parallel() -> None:
    page = (DOCS / "reference/documents.md").read_text("utf-8")
    (example,) = re.findall(r"```xml\n(<\?xml.*?)```", page, re.DOTALL)
    text, diagnostics = export(parse(example))
    regions = ET.fromstring(text.encode()).findall("{*}parallel[@id='wave']/{*}state")
    assert [region.get("initial") for region in regions] == ["arm", None]
    assert element(text, ".//transition[@event='done.state.wave']").get("target") == "wait"
    assert element(text, ".//state[@initial='arm']/datamodel/data").attrib == {"id": "waved", "expr": "0"}
    assert element(text, "parallel/onentry/script").text == 'self.log.info("hello")'
    wordless = [found.message for found in diagnostics if found.code == "N560"]
    assert any("code that runs in every cycle" in message for message in wordless)
    assert any("parameters" in message for message in wordless)
    assert import_(text)[0] == parse(example)


def test_events_have_names_that_scxml_allows_and_none_matches_another() -> None:
    events = "".join(
        f'<transition id="{number}"><origin>1</origin><destiny>2</destiny><trans type="event">{name}</trans></transition>'
        for number, name in enumerate(("go on", "ball", "ball.red", "done.state.a", "done", "*"))
    )
    text, _ = export(parse(one_automaton(events)))
    assert re.findall(r'event="([^"]+)"', text) == [
        "go_x0020_on", "ball", "ball_x002E_red", "done_x002E_state_x002E_a", "_x0064_one", "_x002A_",
    ]  # fmt: skip


def test_an_automaton_that_owns_one_of_its_own_id_comes_back() -> None:
    document = parse(
        '<VisualHFSM><SubAutomata id="1" idFather="1"/><SubAutomata id="1" idFather="0"><state id="1" initial="true">'
        "<name>a</name><idSubautomataSon>1</idSubautomataSon></state></SubAutomata></VisualHFSM>"
    )
    text, diagnostics = export(document)
    assert [found.code for found in diagnostics] == ["W560"]
    assert import_(text)[0] == document


def test_a_guard_of_blanks_is_none_and_comes_back() -> None:
    guarded = '<transition id="1"><origin>1</origin><destiny>2</destiny><trans type="event">e</trans><guard> </guard></transition>'
    document = parse(one_automaton(guarded))
    text, _ = export(document)
    assert "cond=" not in text
    assert import_(text)[0] == document


def test_another_interpreter_does_with_it_what_the_document_means() -> None:
    processors = pytest.importorskip("statemachine.io.scxml.processor")
    text, _ = export(parse(TURNS))
    processor = processors.SCXMLProcessor(trusted=True)
    processor.parse_scxml("turns", text)
    machine = processor.start()
    seen = []
    for event in ("next", "tired", "next", "go_x0020_on", "tired", "next", "next"):
        machine.send(event)
        seen.append("/".join(state.id for state in machine.configuration))
    assert seen == [
        *("work/test", "break/coffee", "break/walk", "work/test"),
        *("break/coffee", "break/walk", "work/test"),
    ]


# Files that another program has changed, and those of others.


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


def scxml(inside: str, attributes: str = "") -> str:
    return f'<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0"{attributes}>{inside}</scxml>'


def facts(document: Document) -> list[str]:
    """Return the automata of a document in a few words."""
    lines = []
    for automaton in document.automata:
        states = " ".join(
            ("*" if state.initial else "")
            + state.name
            + ("!" if state.final else "")
            + "".join(f"<{child}" for child in state.children)
            + (f"({state.history.text})" if not state.history.is_blank else "")
            for state in automaton.states
        )
        names = {state.id: state.name for state in automaton.states}
        transitions = [
            f"{names[each.origin]}->{names[each.destination]} {each.type}:{each.trigger.text}"
            + (f" [{each.guard.text}]" if not each.guard.is_blank else "")
            + (f" {{{each.code.text}}}" if not each.code.is_blank else "")
            for each in automaton.transitions
        ]
        lines.append("; ".join([f"{automaton.id}/{automaton.father}: {states}", *transitions]))
    return lines


_scripts = st.sampled_from(["", "x = 1", "\n  a()\n  b('<&>')\n", "x = ']]>'"])
_triggers = st.one_of(
    st.tuples(
        st.just("event"), st.sampled_from(["go", "go on", "a.b", "done", "error", "_x0020_", "ñ", "*"])
    ),
    st.tuples(st.just("time"), st.sampled_from(["0", "1.5", "500", "60000"])),
    st.tuples(st.just("condition"), st.sampled_from(["x > 1", "True", "self.f()"])),
    st.just(("finished", "")),
)


@st.composite
def charts(draw: st.DrawFn) -> Document:
    """Return a document of which SCXML can express all, numbered as the reader does."""
    automata: list[Automaton] = []

    def grow(father: int, depth: int) -> int:
        own = len(automata) + 1
        automata.append(Automaton(id=own))  # its place
        amount = draw(st.integers(1, 3))
        first = draw(st.integers(1, amount))
        children: list[tuple[int, ...]] = []
        for _ in range(amount):
            below = draw(st.integers(0, 2)) if depth < 3 and len(automata) < 8 else 0
            children.append(tuple(grow(own, depth + 1) for _ in range(below)))
        states = [
            State(
                id=number,
                name=f"s{own}_{number}",
                initial=number == first,
                final=not inside and draw(st.integers(0, 4)) == 0,
                children=inside,
                history=Text(draw(st.sampled_from(["", "restart"])) if inside else ""),
                entry=Text(draw(_scripts)),
                exit=Text(draw(_scripts)),
            )
            for number, inside in enumerate(children, 1)
        ]
        leaving = [state.id for state in states if not state.final]
        ends = draw(st.lists(st.sampled_from(leaving), max_size=4)) if leaving else []
        transitions = []
        for number, origin in enumerate(sorted(ends), 1):
            kind, trigger = draw(_triggers)
            guard = "" if kind == "condition" else draw(st.sampled_from(["", "x < 2"]))
            destination = draw(st.integers(1, amount))
            transitions.append(
                Transition(
                    id=number, origin=origin, destination=destination, type=kind, trigger=Text(trigger),
                    guard=Text(guard), code=Text(draw(_scripts)),
                )
            )  # fmt: skip
        variables = draw(st.sampled_from(["", f"v{own} = 1", f"v{own} = [1]\nw{own} = 'a'"]))
        automata[own - 1] = Automaton(
            id=own,
            father=father,
            states=tuple(states),
            transitions=tuple(transitions),
            variables=Text(variables),
        )
        return own

    grow(0, 1)
    return Document(automata=tuple(automata))


@settings(max_examples=examples(15), deadline=None)
@given(charts())
def test_the_chart_alone_says_what_the_document_does(document: Document) -> None:
    text, reported = export(document)
    start, end = text.index("<hfsm:document>"), text.index("</hfsm:document>")
    chart, diagnostics = import_(text[:start] + text[end + len("</hfsm:document>") :])
    assert chart is not None
    assert (list(reported), list(diagnostics)) == ([], [])
    assert facts(chart) == facts(document)
    for old, new in zip(document.automata, chart.automata, strict=True):
        assert old.variables == new.variables
        assert [(each.entry, each.exit) for each in old.states] == [
            (each.entry, each.exit) for each in new.states
        ]


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
        ["1/0: *a b; a->b event:after.a"],
        ["W561"],
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


def test_variables_are_data_unless_a_name_is_taken() -> None:
    variables = "<variables>{}</variables>"
    automata = one_automaton(variables.format("x = 1")).replace(
        "</SubAutomata>",
        f'</SubAutomata><SubAutomata id="2" idFather="1">{variables.format("x = 2")}</SubAutomata>',
    )
    document = parse(
        automata.replace("<name>b</name>", "<name>b</name><idSubautomataSon>2</idSubautomataSon>")
    )
    text, _ = export(document)
    assert re.findall(r'<data id="(\w+)" expr="(.*?)"', text) == [("x", "1")]
    assert "<variables>x = 2</variables>" in text
    assert import_(text)[0] == document


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
    assert is_scxml("a.xml", head) == expected
    assert is_scxml("a.SCXML", head)


# Hostile files.

_SEEDS = [export(parse(TURNS))[0], *(scxml(inside) for inside, _, _ in FOREIGN.values())]
_PIECES = st.sampled_from(
    [
        *('id="a"', 'target="b a"', 'initial="h"', 'event="done.state.a e.* *"', 'type="internal"', 'cond="("'),
        *('delay="x"', 'hfsm:index="-1"', 'xmlns="urn:x"', "<state/>", "<history/>", "<final/>", "<!-- - -->", "<parallel>"),
        *("</state>", "<initial/>", '<hfsm:SubAutomata id="x"/>', "<hfsm:native-state/>", "<if/>", "text", "&lt;", "_x0000_"),
    ]
)  # fmt: skip


@settings(max_examples=examples(60), deadline=None)
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


@settings(max_examples=examples(40), deadline=None)
@given(st.binary(max_size=200) | any_text(max_size=200).map(str.encode))
def test_what_is_no_xml_is_reported(content: bytes) -> None:
    diagnostics = Diagnostics()
    assert parse_scxml(content, PATH, diagnostics) is None
    assert diagnostics.has_errors


# Real documents.

_FILES = sorted([*(ROOT / "behaviors").glob("*.xml"), *(ROOT / "tests" / "data").rglob("*.xml")])


@pytest.mark.slow
def test_documents_of_the_project_come_back_as_they_were() -> None:
    for path in _FILES:
        document = read_document(path, Diagnostics())
        if document is not None:
            text, _ = export(document)
            again, diagnostics = import_(text)
            assert again == document, path
            assert {found.code for found in diagnostics} <= {"W541"}, diagnostics.render()
            assert violations(text) == [], path
    assert len(_FILES) > 100
