"""Documents that people made between 2013 and 2019 load, count and convert without loss.

They are other people's work and no part of the project: the tests are skipped where they are absent.
"""

from __future__ import annotations

import csv
import re
from functools import cache
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, write_document
from codegen.hfsm.document import NATIVE
from plugins.old_documents.tests.support.document_comparison import counts, differences
from tests.support.codegen_command import ROOT
from visualhfsm._document.conversion import convert_document, read
from visualhfsm_old_documents._languages import is_mostly_cpp

FOLDER = ROOT.parent / "shared" / "automata"
MANIFEST = FOLDER / "manifest.tsv"

COUNTED = ("automata", "states", "transitions", "time_transitions", "composite_states", "depth")
DIALECTS = {
    "spanish2013": "Spanish (2013)",
    "visualhfsm": NATIVE,
    "visualstates": "VisualStates (2017)",
}


def _rows() -> list[dict[str, str]]:
    if not MANIFEST.exists():
        return []
    with MANIFEST.open(newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


pytestmark = pytest.mark.skipif(not MANIFEST.exists(), reason="the collected documents are not here")
every_file = pytest.mark.parametrize("row", _rows(), ids=lambda row: row["file"])


@cache
def _convert(path: Path) -> str:
    diagnostics = Diagnostics()
    text = convert_document(path, diagnostics)
    assert not diagnostics.has_errors, diagnostics.render()
    return text


@every_file
def test_counts_are_those_of_the_list(row: dict[str, str]) -> None:
    found = counts(_convert(FOLDER / row["file"]))
    assert found == {name: int(row[name]) for name in COUNTED}


@every_file
def test_nothing_is_lost(row: dict[str, str], tmp_path: Path) -> None:
    path = FOLDER / row["file"]
    text = _convert(path)
    if "&amp;lt;" in path.read_text() and "&amp;lt;" not in text:
        # What was escaped twice is undone, and nothing else.
        once = re.sub("&amp;(?=lt;|gt;)", "&", path.read_text())
        path = tmp_path / path.name
        path.write_text(once)
    assert differences(path, text) == []


@every_file
def test_the_converted_document_reads_as_the_old_one(row: dict[str, str]) -> None:
    path = FOLDER / row["file"]
    old = read(path, Diagnostics())
    diagnostics = Diagnostics()
    text = _convert(path)
    new = parse_document(text, path, diagnostics)
    assert new == old
    assert new is not None
    assert write_document(new) == text
    assert not len(diagnostics), diagnostics.render()


@every_file
def test_dialect_and_language_are_recognized(row: dict[str, str]) -> None:
    path = FOLDER / row["file"]
    document = read(path, Diagnostics())
    assert document is not None
    assert document.format == DIALECTS[row["dialect"]]
    assert is_mostly_cpp(document) == (row["lang"] == "cpp")
    guessed = row["lang"] == "cpp" and row["dialect"] != "visualhfsm"
    assert document.language.text == ("C++" if guessed else "")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("<posx>831</posx>", "<posx>832</posx>"),
        ('id="7"', 'id="77"'),
        ("closing_loop = False", "closing_loop  = False"),
        ("<ip>localhost</ip>", "<ip>there</ip>"),
        ("<name>land</name>", "<name>Land</name>"),
        ('<trans type="time">5000', '<trans type="time">500'),
        ("<serverType>ice", "<serverType>"),
        ("<name>root</name>", ""),
    ],
)
def test_the_comparison_sees_what_is_lost(old: str, new: str) -> None:
    path = FOLDER / "visualstates" / "ArDrone-1d893f35.xml"
    text = _convert(path)
    assert old in text
    assert differences(path, text.replace(old, new)) != []
