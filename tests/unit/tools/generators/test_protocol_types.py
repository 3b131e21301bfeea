"""The types of the page's messages are those of Python."""

from __future__ import annotations

import re
from dataclasses import fields

import pytest

from codegen.hfsm import document as model
from codegen.hfsm.document import (
    Argument,
    Automaton,
    Document,
    Event,
    Import,
    Interface,
    Library,
    Node,
    Parameter,
    Property,
    RosInterface,
    State,
    Transition,
)
from tools.generators.protocol_types import FILE
from visualhfsm._document.views import view

ELEMENTS = [
    Argument(name="speed"),
    Automaton(id=1),
    Document(),
    Event(name="goal"),
    Import(file=model.Text("other.xml")),
    Interface(name="Head"),
    Library(name=model.Text("math")),
    Parameter(name="speed"),
    Property(),
    RosInterface(name="odom"),
    State(id=1, name="walk"),
    Transition(id=1, origin=1, destination=1),
]


def members(name: str) -> list[str]:
    """Return the names of the fields of an interface of the page."""
    found = re.search(
        rf"^export interface {name} {{\n(.*?)^}}", FILE.read_text("utf-8"), re.DOTALL | re.MULTILINE
    )
    assert found is not None, name
    return re.findall(r"^  (\w+)\??:", found[1], re.MULTILINE)


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda element: type(element).__name__)
def test_elements_of_documents_have_the_fields_that_the_page_gets(element: Node) -> None:
    names = {"Document": "DocumentFields", "Event": "DocumentEvent"}
    name = type(element).__name__
    assert sorted(members(names.get(name, name))) == sorted(view(element))


def test_a_field_that_a_message_may_leave_out_is_optional() -> None:
    text = FILE.read_text("utf-8")
    assert "  open: {path: string};\n" in text
    assert "  new: {template?: string};\n" in text
    assert re.search(r"interface DocumentPush \{[^}]*  tab: number;[^}]*  full: Fields &", text)
    assert re.search(r"interface Place \{[^}]*  kind: [^}]*  id\?: number;", text)


def test_every_command_and_request_has_its_fields() -> None:
    assert {"addState", "setText", "placeItems"} <= {*members("Commands")}
    assert {"hello", "do", "undo", "pause", "saveAs"} <= {*members("Requests")}
    assert "op" not in members("Requests")
    assert len(fields(Document)) > len(members("DocumentFields"))  # automata and what only files have
