"""How the page shows automata from other files, and how automata move to separate files and back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document, write_document
from codegen.hfsm.document import Document, Text
from codegen.hfsm.loading import check_document
from tests.support.documents import document, state, sub
from tests.support.editing import texted, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.automata import SetImport
from visualhfsm._document.commands.component import AddEntry
from visualhfsm.project._editing.imports import extract, imported_content, imported_views, inline

STUB = '<SubAutomata id="2" idFather="1"><import automaton="{}">{}</import></SubAutomata>\n'


def views(directory: Path, file: str = "library/search.xml", automaton: int = 1) -> list[dict[str, Any]]:
    path = directory / "patrol.xml"
    root = sub(1, 0, state(1, "look", initial=True, child=2), state(2, "rest"))
    path.write_text(document(root, STUB.format(automaton, file)))
    found = read_document(path, Diagnostics())
    assert found is not None
    return imported_views(found, path)


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """A directory whose `library/search.xml` has an automaton below its root."""
    path = tmp_path / "library" / "search.xml"
    path.parent.mkdir()
    below = sub(2, 1, state(1, "up", initial=True), state(2, "down"))
    path.write_text(document(sub(1, 0, state(1, "left", initial=True, child=2), state(2, "right")), below))
    return tmp_path


def test_imported_automata_come_with_the_ids_that_they_run_under(library: Path) -> None:
    top, below = views(library)
    assert (top["id"], top["father"], below["id"], below["father"]) == (2, 1, 2002, 2)
    assert [each["name"] for each in top["states"]] == ["left", "right"]
    assert top["states"][0]["children"] == [below["id"]]
    assert [each["name"] for each in below["states"]] == ["up", "down"]


def test_they_know_where_they_come_from(library: Path) -> None:
    top, below = views(library)
    assert top["imported"] == {"file": "library/search.xml", "automaton": 1}
    assert below["imported"]["file"] == "library/search.xml"


@pytest.mark.parametrize(
    ("file", "automaton"), [("gone.xml", 1), ("library/search.xml", 9), ("../up.xml", 1)]
)
def test_what_cannot_be_had_is_left_out(library: Path, file: str, automaton: int) -> None:
    assert views(library, file, automaton) == []


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


def test_what_the_code_needs_is_declared_in_the_new_file_too(tmp_path: Path) -> None:
    path, part = tmp_path / "main.xml", tmp_path / "part.xml"
    document = replace(tree(), dialect=Text("VisualStates"))
    for name in ("speed", "limit"):
        document = AddEntry(
            list="parameters", fields={"name": name, "type": "float", "default": "0.5"}
        ).apply(document)
    document = texted(
        document, "far = self.speed > self.limit", kind="automaton", automaton=2, part="variables"
    )
    extracted = extract(document, 2, path, part).apply(document)
    diagnostics = Diagnostics()
    check_document(part, diagnostics, limit=0)
    assert [each.message for each in diagnostics if "self." in each.message] == []
    assert read(part).dialect.text == "VisualStates"
    path.write_text(write_document(extracted))
    check_document(path, diagnostics, limit=0)
    assert diagnostics.errors == []


def test_what_its_file_declares_comes_along_with_an_automaton(tmp_path: Path) -> None:
    path, part = tmp_path / "main.xml", tmp_path / "part.xml"
    document = AddEntry(list="libraries", fields={"name": "math"}).apply(tree())
    document = extract(document, 2, path, part).apply(document)
    library = AddEntry(list="libraries", fields={"name": "numpy as np"}).apply(read(part))
    library = AddEntry(list="interfaces", fields={"name": "head", "proxy": "Head", "type": "PoseHead"}).apply(
        library
    )
    library = texted(library, "def above(self):\n    pass\n", kind="automaton", automaton=2, part="functions")
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
