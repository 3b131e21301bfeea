"""Documents as SCXML, and back."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.document import Document
from codegen.hfsm.formats.others import writable_formats
from codegen.hfsm.formats.xml_tree import parse_xml

__all__ = ["PATH", "TURNS", "export", "facts", "import_", "one_automaton", "parse", "scxml"]

PATH: Final = Path("test.xml")
_FILE: Final = Path("test.scxml")

TURNS: Final = """<VisualHFSM>
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
"""A document with states inside states, which go on or begin again."""


def parse(text: str) -> Document:
    """Return the document that a text is."""
    diagnostics = Diagnostics()
    document = parse_document(text, PATH, diagnostics)
    assert document is not None, diagnostics.render()
    return document


def export(document: Document) -> tuple[str, Diagnostics]:
    """Return a document as SCXML, and what is reported."""
    diagnostics = Diagnostics()
    return writable_formats()[".scxml"].write(document, PATH, diagnostics), diagnostics


def import_(text: str | bytes) -> tuple[Document | None, Diagnostics]:
    """Return the document that SCXML becomes, and what is reported."""
    diagnostics = Diagnostics()
    content = text.encode() if isinstance(text, str) else text
    root = parse_xml(content, _FILE, diagnostics)
    if root is None:
        return None, diagnostics
    return writable_formats()[".scxml"].read(root, _FILE, diagnostics, None), diagnostics


def one_automaton(inside: str) -> str:
    """Return a document with the states 1 and 2, a and b, and more."""
    return (
        '<VisualHFSM><SubAutomata id="1" idFather="0"><state id="1" initial="true"><name>a</name></state>'
        f'<state id="2"><name>b</name></state>{inside}</SubAutomata></VisualHFSM>'
    )


def scxml(inside: str, attributes: str = "") -> str:
    """Return SCXML with this inside."""
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
