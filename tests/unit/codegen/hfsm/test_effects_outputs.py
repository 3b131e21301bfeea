"""Outputs and inputs carry values between automata: what follows for events and conditions."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm._definitions import Answer
from codegen.hfsm._effects import CodeEffects
from codegen.hfsm.analysis import analyze
from codegen.hfsm.formats.reader import read_document
from codegen.hfsm.model_checker import Verdict, check_model
from tests.support.coded_documents import sent_by
from tests.support.documents import document, state, sub, transition


def effects_of(tmp_path: Path, code: str, type_name: str, default: str) -> CodeEffects:
    """Return the effects of a document in which the root takes `what` of an automaton with this code."""
    root = state(1, "ask", "self.send(what)", initial=True, child=2)
    root = root.replace("</state>", '<result name="said">what</result></state>')
    below = f"<output><name>said</name><type>{type_name}</type><default>{default}</default></output>"
    path = tmp_path / "ask.xml"
    path.write_text(
        document(
            sub(1, 0, root, transition(1, 1, 1, "what == 1"), variables="what = None"),
            sub(2, 1, state(1, "hear", code, initial=True), below),
        )
    )
    read = read_document(path, Diagnostics())
    assert read is not None
    return CodeEffects(analyze(read, path))


def test_the_texts_of_an_output_are_the_events_that_the_automaton_above_sends(tmp_path: Path) -> None:
    effects = effects_of(tmp_path, "said = 'left' if self.turned else 'right'", "str", '"none"')
    sends = effects.of(effects.analysis.document.automata[0].states[0].code)
    assert set(sends.events) == {"left", "right", "none"}
    assert not sends.any_event


def test_a_text_that_is_unknown_below_may_be_any_event_above(tmp_path: Path) -> None:
    effects = effects_of(tmp_path, "said = self.hear()", "str", '""')
    assert effects.of(effects.analysis.document.automata[0].states[0].code).any_event


@pytest.mark.parametrize(
    ("type_name", "default", "code", "answer"),
    [
        ("int", "0", "said = 1", Answer.SAME),
        ("object", "None", "said = 1", Answer.SAME),
        ("object", "[]", "said = 1", Answer.OTHER),
        ("object", "None", "said = [1]", Answer.OTHER),
    ],
)
def test_a_condition_on_an_object_from_below_may_answer_differently(
    tmp_path: Path, type_name: str, default: str, code: str, answer: Answer
) -> None:
    effects = effects_of(tmp_path, code, type_name, default)
    condition = effects.analysis.document.automata[0].transitions[0].trigger
    assert (effects.of(condition).answer == Answer.SAME) == (answer == Answer.SAME)


REFUSED = """<VisualHFSM>
  <properties><property kind="never"><expression>ask/gone</expression></property></properties>
  <SubAutomata id="1" idFather="0">
    <state id="1" initial="true"><name>ask</name><child>2</child>
      <argument name="word">"stay"</argument><argument name="far">self.measure()</argument></state>
    <transition id="1"><origin>1</origin><destiny>1</destiny>
      <trans type="event">refused</trans><guard>False</guard></transition>
    <functions>def measure(self):
    raise InvalidValueException("too dark")</functions>
  </SubAutomata>
  <SubAutomata id="2" idFather="1">
    <state id="1" initial="true"><name>here</name><code>self.send(word)</code></state>
    <state id="2"><name>gone</name></state>
    <transition id="1"><origin>1</origin><destiny>2</destiny><trans type="event">go</trans></transition>
    <input><name>word</name><type>str</type><default>"go"</default></input>
    <input><name>far</name><type>float</type><default>0.0</default></input>
  </SubAutomata>
  <libraries><lib>from interfaces.jderobot import InvalidValueException</lib></libraries>
</VisualHFSM>"""


def test_an_input_keeps_its_default_when_a_servant_refuses_an_argument(tmp_path: Path) -> None:
    path = tmp_path / "ask.xml"
    path.write_text(REFUSED)
    read = read_document(path, Diagnostics())
    assert read is not None
    assert sent_by(path) == {"go"}
    assert check_model(read, path).properties[0].verdict is Verdict.VIOLATED
