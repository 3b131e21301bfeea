"""The programs of docs/how-to/plain-python.md print what the page says, and draw its picture."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from tests.support.pages import DOCS, blocks_of
from tests.support.screenshots import FOLDER
from visualhfsm import OpenDocument, Project

PAGE = (DOCS / "how-to" / "plain-python.md").read_text("utf-8")
BLOCKS = blocks_of(PAGE)
PICTURE = FOLDER / "plain-python" / "look.svg"


@pytest.mark.slow
def test_the_programs_print_what_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    programs = [block.text for block in BLOCKS if block.language == "python"]
    outputs = [block.text for block in BLOCKS if block.language == "text"]
    for program, output in zip(programs, outputs, strict=True):
        exec(compile(program, "plain-python.md", "exec"), {})
        assert capsys.readouterr().out == output
    drawn = (tmp_path / "look.svg").read_text("utf-8")
    if os.environ.get("SCREENSHOTS"):
        PICTURE.write_text(drawn, "utf-8")
    assert drawn == PICTURE.read_text("utf-8")


def test_the_table_names_what_a_document_can_do() -> None:
    table = PAGE.partition("| | |")[2].partition("\n\n")[0]
    named = {
        name
        for row in table.splitlines()
        for name in re.findall(r"`(\w+)`", row.partition("|")[2].partition("|")[0])
    }
    methods = {
        name
        for name in dir(OpenDocument)
        if not name.startswith("_") and callable(getattr(OpenDocument, name))
    }
    assert named == methods - {"text", "abandon", "has", "imports"}
    assert callable(Project.recoverable)
