"""Documents are written as SCXML that conforms to the recommendation."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import pytest

from plugins.old_documents.tests.support.scxml_documents import TURNS, export, import_, one_automaton, parse
from tests.support.pages import DOCS


def element(text: str, path: str) -> ET.Element:
    found = ET.fromstring(text.encode()).find(path, {"": "http://www.w3.org/2005/07/scxml"})
    assert found is not None, path
    return found


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
    assert element(text, "datamodel/data").attrib == {"id": "waves", "expr": "0"}
    assert element(text, "parallel/onentry/script").text == 'self.log.info("hello")'
    wordless = [found.message for found in diagnostics if found.code == "N560"]
    assert any("code that runs in every cycle" in message for message in wordless)
    for what in ("parameters", "the output of an automaton", "the result of a state"):
        assert any(what in message for message in wordless)
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
