"""Templates, views, and automata that move to separate files and back."""

from __future__ import annotations

import sys
from pathlib import Path

import msgspec
import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document, write_document
from codegen.hfsm.document import Document
from tests.support.editing import tree
from visualhfsm.editing.commands.automata import SetAutomatonCode, SetImport
from visualhfsm.editing.commands.component import AddEntry
from visualhfsm.editing.commands.states import SetArgument
from visualhfsm.editing.views import view
from visualhfsm.errors import EditError
from visualhfsm.robots import find_worlds
from visualhfsm.sessions.imports import extract, imported_content, inline
from visualhfsm.sessions.templates import find_templates, make_template


def read(path: Path) -> Document:
    document = read_document(path, Diagnostics())
    assert document is not None
    return document


def test_an_automaton_moves_to_a_file_and_back(tmp_path: Path) -> None:
    path = tmp_path / "main.xml"
    document = AddEntry(
        list="interfaces", fields={"name": "head", "proxy": "Head", "type": "PoseHead"}
    ).apply(tree())
    command = extract(document, 2, path, tmp_path / "part.xml")
    extracted = command.apply(document)
    assert [each.id for each in extracted.automata] == [1, 2, 3]
    stub = extracted.automata[1]
    assert stub.imported is not None
    assert (stub.imported.file.text, stub.states, stub.father) == ("part.xml", (), 1)
    library = read(tmp_path / "part.xml")
    assert library.root is not None
    assert library.root.states == document.automata[1].states
    assert [each.name for each in library.interfaces] == ["head"]
    content = imported_content(extracted, 2, path)
    assert [len(each.states) for each in content.automata] == [2, 1]
    assert content.automata[0].states[0].children == (content.automata[1].id,)
    back = inline(extracted, 2, path).apply(extracted)
    assert len(back.automata) == 4
    assert back.automata[1].transitions == document.automata[1].transitions
    assert back.automata[3].states == document.automata[3].states


def test_what_its_file_declares_comes_along_with_an_automaton(tmp_path: Path) -> None:
    path, part = tmp_path / "main.xml", tmp_path / "part.xml"
    document = AddEntry(list="libraries", fields={"name": "math"}).apply(tree())
    document = extract(document, 2, path, part).apply(document)
    library = AddEntry(list="libraries", fields={"name": "numpy as np"}).apply(read(part))
    library = AddEntry(list="interfaces", fields={"name": "head", "proxy": "Head", "type": "PoseHead"}).apply(
        library
    )
    library = SetAutomatonCode(automaton=2, part="functions", text="def above(self):\n    pass\n").apply(
        library
    )
    part.write_text(write_document(library))
    document = SetImport(automaton=2, file="part.xml", source=4).apply(document)
    back = inline(document, 2, path).apply(document)
    assert [each.name.text for each in back.libraries] == ["math", "numpy as np"]
    assert [each.name for each in back.interfaces] == ["head"]
    assert back.automata[1].functions.text == "def above(self):\n    pass"
    assert [state.name for state in back.automata[1].states] == ["deep"]


@pytest.mark.parametrize(
    ("automaton", "name", "why"),
    [
        (1, "part.xml", "it is the root"),
        (2, "main.xml", "the file exists"),
        (2, "../part.xml", "not in the directory"),
        (2, "missing/part.xml", "No such file"),
        (9, "part.xml", "it does not exist"),
    ],
)
def test_an_automaton_that_cannot_move_stays(tmp_path: Path, automaton: int, name: str, why: str) -> None:
    path = tmp_path / "main.xml"
    path.write_text("x")
    with pytest.raises(EditError, match=why):
        extract(tree(), automaton, path, tmp_path / name)
    assert [each.name for each in tmp_path.iterdir()] == ["main.xml"]


def test_what_cannot_be_read_is_not_inlined(tmp_path: Path) -> None:
    path = tmp_path / "main.xml"
    with pytest.raises(EditError, match="it is not imported"):
        inline(tree(), 2, path)
    document = extract(tree(), 2, path, tmp_path / "part.xml").apply(tree())
    document = SetImport(automaton=2, file="gone.xml").apply(document)
    with pytest.raises(EditError, match="is not found"):
        inline(document, 2, path)
    with pytest.raises(EditError, match="save it first"):
        extract(tree(), 2, None, tmp_path / "other.xml")


def test_there_is_an_empty_template_and_the_behaviors_without_importing_them() -> None:
    modules = set(sys.modules)
    templates = find_templates()
    assert [each.name for each in templates] == ["empty", "dance", "dance_and_follow", "follow_ball", "score"]
    assert all(each.description for each in templates)
    assert not {name for name in set(sys.modules) - modules if name.startswith("behaviors")}
    assert make_template("")[1] == make_template("empty")[1]
    name, document = make_template("follow_ball")
    assert name == "follow_ball"
    assert len(document.automata[0].states) > 1
    _, document = make_template("dance_and_follow")  # wherever the new document is saved, it is whole
    assert not [each for each in document.automata if each.imported]
    assert len(document.automata[2].states) > 1
    assert make_template("score")[1].world.text in {world.name for world in find_worlds()}
    with pytest.raises(EditError, match="there is no template"):
        make_template("../x")


def test_the_page_gets_all_that_it_draws() -> None:
    document = AddEntry(list="parameters", fields={"name": "speed"}).apply(tree())
    document = SetArgument(automaton=1, state=2, name="n", value="1").apply(document)
    data = msgspec.json.decode(msgspec.json.encode(view(document)))
    assert data["parameters"] == [{"name": "speed", "type": "float", "default": "0.0", "description": ""}]
    assert set(data) == {
        *("description", "onError", "onRefused", "world", "language", "parameters", "events"),
        *("properties", "libraries", "interfaces", "ros"),
    }
    automaton = msgspec.json.decode(msgspec.json.encode(view(document.automata[0])))
    assert (automaton["id"], automaton["father"], automaton["period"]) == (1, 0, "100")
    assert automaton["states"][1] == {
        "id": 2, "name": "work", "x": 300.0, "y": 100.0, "initial": False, "final": False, "children": [2, 3],
        "history": "", "entry": "", "code": "", "exit": "", "arguments": [{"name": "n", "child": 0, "value": "1"}],
    }  # fmt: skip
    assert automaton["transitions"][0] == {
        "id": 1, "name": "go", "x": 200.0, "y": 80.0, "origin": 1, "destination": 2, "type": "condition",
        "trigger": "x > 1", "guard": "", "priority": "", "code": "",
    }  # fmt: skip


def test_a_document_of_nothing_has_views() -> None:
    assert view(Document())["parameters"] == []
    assert write_document(Document())
