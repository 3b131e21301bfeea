"""docs/reference/automata.md: its documents are checked, compiled and run as described."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document, read_document
from hfsm_runtime import VirtualRun
from hfsm_runtime.tree import ChangeKind
from tests.support.documents import load
from tests.support.failures import FOLLOWS, NAMES, Ends
from tests.support.pages import DOCS, blocks_of
from visualhfsm._drawing.svg import svg

PAGE = (DOCS / "reference/automata.md").read_text("utf-8")
BLOCKS = blocks_of(PAGE)
DOCUMENTS = [block.name for block in BLOCKS if block.name is not None]
TIMELINES = {block.info.split()[1]: block for block in BLOCKS if block.language == "timeline"}


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a directory with all documents of the page and their components."""
    tmp_path = tmp_path_factory.mktemp("automata")
    for block in BLOCKS:
        if block.name is not None:
            (tmp_path / block.name).write_text(block.text, encoding="utf-8")
    for name in DOCUMENTS:
        diagnostics = Diagnostics()
        files = compile_document(tmp_path / name, None, diagnostics)
        assert files is not None, diagnostics.render()
        assert list(diagnostics) == [], diagnostics.render()
        for file in files:
            file.path.write_text(file.text, encoding="utf-8")
    return tmp_path


def test_every_block_of_xml_is_a_document_with_a_name_or_marked_as_a_fragment() -> None:
    assert [
        block.text
        for block in BLOCKS
        if block.language == "xml" and not block.name and "fragment" not in block.info
    ] == []
    assert {f"{name}.xml" for name in TIMELINES} <= set(DOCUMENTS)


def test_the_picture_of_the_first_document_is_what_python_draws(directory: Path) -> None:
    document = read_document(directory / "blink.xml", Diagnostics())
    assert document is not None
    shown = (DOCS / "pictures/automata/blink.svg").read_text("utf-8")
    assert shown == svg(document, 1, component="blink"), "draw it again: visualhfsm draw --force"


@pytest.mark.parametrize("name", TIMELINES)
def test_a_document_does_what_the_page_says(name: str, directory: Path) -> None:
    block = TIMELINES[name]
    virtual = VirtualRun(load(directory / f"{name}.py"))
    virtual.advance(float(block.info.split()[2]))
    entered = [
        f"{change.time:.1f} {change.automaton} {change.state}"
        for change in virtual.trace
        if change.kind is ChangeKind.ENTERED
    ]
    assert entered == block.text.splitlines()
    assert not virtual.halted


def test_a_declared_event_from_outside_ends_the_calls(directory: Path) -> None:
    virtual = VirtualRun(load(directory / "calls.py"))
    virtual.advance(1)
    virtual.send("go home")
    virtual.advance(0.1)
    assert virtual.finished


def test_the_page_of_the_format_explains_every_element_that_the_documents_use() -> None:
    rows = re.findall(r"^\| (`.*?) \|", (DOCS / "reference/documents.md").read_text("utf-8"), re.MULTILINE)
    explained = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    used = {tag for block in BLOCKS if block.language == "xml" for tag in re.findall(r"<(\w+)", block.text)}
    parts = {"VisualHFSM", "name", "event", "parameter", "type", "default"}
    assert used - explained - parts == set()


@pytest.mark.parametrize("piece", FOLLOWS)
def test_what_follows_a_failure_is_what_the_runtime_does(piece: str) -> None:
    cells = (NAMES[piece], *(FOLLOWS[piece][ends].text for ends in Ends))
    assert f"| {' | '.join(cells)} |" in PAGE
