"""States of a document become a ready state of the project, which runs by itself."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Document
from visualhfsm import OpenDocument, Project
from visualhfsm._base.errors import EditError, WouldOverwriteError

GREETING = """<VisualHFSM>
  <events><event><name>hello</name></event><event><name>unheard</name></event></events>
  <SubAutomata id="1" idFather="0">
    <state id="1" initial="true"><name>greet</name><idSubautomataSon>2</idSubautomataSon></state>
    <state id="2"><name>count</name><code>n += 1</code></state>
    <state id="3"><name>rest</name></state>
    <transition id="1"><origin>2</origin><destiny>3</destiny><name>enough</name>
      <trans type="condition">n &gt; 3</trans></transition>
    <transition id="2"><origin>3</origin><destiny>1</destiny><name>again</name>
      <trans type="event">hello</trans></transition>
    <variables>n = 0</variables>
  </SubAutomata>
  <SubAutomata id="2" idFather="1">
    <state id="1" initial="true"><name>wave</name><entry>self.Arm.getJoints()</entry></state>
    <state id="2"><name>waved</name><final>true</final></state>
    <transition id="1"><origin>1</origin><destiny>2</destiny><name>heard</name>
      <trans type="event">hello</trans></transition>
    <input><name>times</name><type>int</type><default>2</default></input>
  </SubAutomata>
  <config>
    <iceinterface><nameinterface>Arm</nameinterface><nameproxy>Arm</nameproxy><interface>Joints</interface></iceinterface>
    <iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface></iceinterface>
  </config>
</VisualHFSM>
"""
IMPORTING = """<VisualHFSM><SubAutomata id="1" idFather="0">
  <state id="1" initial="true"><name>both</name><idSubautomataSon>2</idSubautomataSon></state></SubAutomata>
  <SubAutomata id="2" idFather="1"><import>parts/greeting.xml</import></SubAutomata></VisualHFSM>
"""


@pytest.fixture
def project(tmp_path: Path) -> Iterator[Project]:
    (tmp_path / "greeting.xml").write_text(GREETING)
    with Project(tmp_path) as project:
        yield project


@pytest.fixture
def greeting(project: Project) -> OpenDocument:
    return project.open("greeting.xml")


def read(path: Path) -> Document:
    diagnostics = Diagnostics()
    document = read_document(path, diagnostics)
    assert document is not None, diagnostics.errors
    assert not diagnostics.errors
    return document


def test_a_state_with_an_automaton_is_that_automaton_with_what_it_uses(
    project: Project, greeting: OpenDocument
) -> None:
    path = greeting.put_on_shelf(
        1, [1], "Wave, and wait!", category="Greet", words="hi", description="It waves. Then it waits."
    )
    assert path.name == "wave_and_wait.xml"
    made = read(path)
    assert made.root is not None
    assert [state.name for state in made.root.states] == ["wave", "waved"]
    assert [each.name for each in made.interfaces] == ["Arm"]
    assert [each.name for each in made.events] == ["hello"]
    found = next(each for each in project.shelf() if each.own)
    assert (found.title, found.category, found.words) == ("Wave, and wait!", "Greet", "hi")
    assert (found.summary, [each.name for each in found.inputs]) == ("It waves.", ["times"])
    assert not found.trouble
    greeting.add_ready_state(found.id, automaton=1, x=500, y=100)
    assert greeting.automata[0].states[-1].name == "wave, and wait!"
    greeting.add_ready_state(
        found.id, automaton=1, x=500, y=300, origin=1, name="Saludar y esperar", language="es"
    )
    assert greeting.automata[0].states[-1].name == "saludar y esperar"
    assert greeting.automata[0].transitions[-1].name.startswith("transición ")


def test_states_with_code_are_with_their_transitions_and_variables(greeting: OpenDocument) -> None:
    made = read(greeting.put_on_shelf(1, [2, 3], "Count"))
    assert made.root is not None
    assert [(state.name, state.initial) for state in made.root.states] == [("count", True), ("rest", False)]
    assert [each.name for each in made.root.transitions] == ["enough"]
    assert made.root.variables.text == "n = 0"
    assert not made.interfaces


def test_an_imported_automaton_becomes_a_part(project: Project, tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "greeting.xml").rename(tmp_path / "parts" / "greeting.xml")
    (tmp_path / "both.xml").write_text(IMPORTING)
    made = read(project.open("both.xml").put_on_shelf(1, [1], "Both"))
    assert made.root is not None
    assert [state.name for state in made.root.states] == ["greet", "count", "rest"]
    assert [each.name for each in made.interfaces] == ["Arm"]


def test_what_is_there_stays_and_each_refusal_says_why(greeting: OpenDocument, tmp_path: Path) -> None:
    first = greeting.put_on_shelf(1, [1], "Wave")
    before = first.read_bytes()
    with pytest.raises(WouldOverwriteError, match=r"shelf/wave\.xml already exists"):
        greeting.put_on_shelf(1, [2], "wave ")
    assert first.read_bytes() == before
    with pytest.raises(EditError, match="it has no title"):
        greeting.put_on_shelf(1, [2], " !? ")
    with pytest.raises(EditError, match="no state is selected"):
        greeting.put_on_shelf(1, [], "Nothing")


def test_a_folder_that_is_a_file_is_named(greeting: OpenDocument, tmp_path: Path) -> None:
    (tmp_path / "shelf").write_text("")
    with pytest.raises(EditError, match="Cannot create the folder shelf"):
        greeting.put_on_shelf(1, [1], "Wave")
