"""What an open document imports, read again when its files change."""

from __future__ import annotations

import os
from pathlib import Path

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Document
from tests.support.documents import document, state, sub
from visualhfsm._document.imported_places import ImportedPlaces
from visualhfsm._document.places import Place, texts_at
from visualhfsm._editor.tab import Imports

CODE = Place(kind="state", automaton=2, id=1, part="code")


def write(file: Path, code: str) -> None:
    """Write the imported file; its time of change is a new one."""
    before = file.stat().st_mtime_ns if file.exists() else 0
    file.write_text(document(sub(1, 0, state(1, "look", code, initial=True))))
    os.utime(file, ns=(before + 10**9, before + 10**9))


def places(directory: Path) -> ImportedPlaces:
    path = directory / "robot.xml"
    imported = '<SubAutomata id="2" idFather="1"><import>look.xml</import></SubAutomata>'
    path.write_text(document(sub(1, 0, state(1, "top", initial=True, child=2)), imported))
    found = read_document(path, Diagnostics())
    assert found is not None
    return ImportedPlaces(found, path)


def own(directory: Path) -> Document:
    found = read_document(directory / "robot.xml", Diagnostics())
    assert found is not None
    return found


def test_a_document_that_imports_nothing_never_changes(tmp_path: Path) -> None:
    none = Imports()
    assert Imports.read(ImportedPlaces(Document(), tmp_path / "robot.xml"), none) is none
    assert not none.differ()


def test_they_differ_once_the_file_is_there_or_changes(tmp_path: Path) -> None:
    missing = Imports.read(places(tmp_path), Imports())
    assert not missing.differ()
    write(tmp_path / "look.xml", "1")
    assert missing.differ()
    first = Imports.read(places(tmp_path), missing)
    assert Imports.read(places(tmp_path), first) is first
    write(tmp_path / "look.xml", "2")
    assert first.differ()
    assert Imports.read(places(tmp_path), first).number == first.number + 1


def test_a_document_has_their_code_in_the_place_of_the_import(tmp_path: Path) -> None:
    write(tmp_path / "look.xml", "1")
    imports = Imports.read(places(tmp_path), Imports())
    assert texts_at(own(tmp_path), CODE) == ()
    assert texts_at(imports.within(own(tmp_path)), CODE) == ("1",)
