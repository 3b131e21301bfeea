"""How the page shows automata from other files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from tests.support.documents import document, state, sub
from visualhfsm.sessions.imports import imported_views

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
