"""What the page gets of a document."""

from __future__ import annotations

import msgspec

from codegen.hfsm import write_document
from codegen.hfsm.document import Document
from tests.support.editing import texted, tree
from visualhfsm._document.commands.component import AddEntry
from visualhfsm._document.views import view


def test_the_page_gets_all_that_it_draws() -> None:
    document = AddEntry(list="parameters", fields={"name": "speed"}).apply(tree())
    document = texted(document, "1", kind="state", id=2, part="argument", name="n")
    data = msgspec.json.decode(msgspec.json.encode(view(document)))
    assert data["parameters"] == [{"name": "speed", "type": "float", "default": "0.0", "description": ""}]
    assert set(data) == {
        *("description", "onError", "onRefused", "world", "language", "parameters", "events"),
        *("properties", "survives", "libraries", "interfaces", "ros"),
    }
    automaton = msgspec.json.decode(msgspec.json.encode(view(document.automata[0])))
    assert (automaton["id"], automaton["father"], automaton["period"]) == (1, 0, "100")
    assert automaton["states"][1] == {
        "id": 2, "name": "work", "x": 300.0, "y": 100.0, "initial": False, "final": False, "children": [2, 3],
        "history": "", "entry": "", "code": "", "exit": "", "arguments": [{"name": "n", "child": 0, "value": "1"}],
        "results": [],
    }  # fmt: skip
    assert automaton["transitions"][0] == {
        "id": 1, "name": "go", "x": 200.0, "y": 80.0, "origin": 1, "destination": 2, "type": "condition",
        "trigger": "x > 1", "guard": "", "priority": "", "code": "",
    }  # fmt: skip


def test_a_document_of_nothing_has_views() -> None:
    assert view(Document())["parameters"] == []
    assert write_document(Document())
