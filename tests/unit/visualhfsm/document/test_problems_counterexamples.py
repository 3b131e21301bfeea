"""Violated properties among the problems of a document, with the steps that violate them."""

from __future__ import annotations

from tests.support.editing import find_problems
from visualhfsm._document.places import Place
from visualhfsm._document.problems import StepView

DOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <properties>
    <property kind="always"><name>somewhere</name><expression>wait or go</expression></property>
    <property kind="never"><name>stay</name><expression>go</expression></property>
  </properties>
  <SubAutomata id="1" idFather="0">
    <state initial="true" id="1"><name>wait</name></state>
    <state id="2"><name>go</name><final>true</final></state>
    <transition id="7"><name>soon</name><origin>1</origin><destiny>2</destiny><trans type="time">200</trans></transition>
  </SubAutomata>
</VisualHFSM>
"""


def test_a_violated_property_has_the_steps_that_violate_it() -> None:
    (problem,) = find_problems(DOCUMENT, None)
    assert problem.place == Place(kind="document", part="properties", index=1, name="expression")
    assert problem.counterexample is not None
    *_, last = (step for step in problem.counterexample.steps if step.kind == "fires")
    assert last == StepView(
        time_ms=200.0, automaton=1, kind="fires", text=last.text, state=2, origin=1, transition=7
    )


def test_other_problems_have_no_steps() -> None:
    problems = find_problems(DOCUMENT.replace("<final>true</final>", ""), None)
    codes = {problem.code: problem.counterexample is not None for problem in problems}
    assert codes.pop("E610") is True
    assert codes
    assert not any(codes.values())
