"""plugins/old_documents/docs/scxml.md: its example is the output of the command, in both directions."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from plugins.old_documents.tests.support.scxml_rules import violations
from tests.support.pages import blocks_of
from tests.support.places import ROOT
from visualhfsm._commands.app import app

EXAMPLES = {
    block.name: block.text
    for block in blocks_of((ROOT / "plugins/old_documents/docs/scxml.md").read_text("utf-8"))
    if block.name
}
EXAMPLES["doorbell.scxml"] = EXAMPLES["doorbell.scxml"].replace(
    "…", EXAMPLES["doorbell.xml"].partition("\n")[2]
)


def convert(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["convert", *arguments])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in EXAMPLES.items():
        (tmp_path / str(name)).write_text(text)
    return tmp_path


def test_the_document_is_written_as_the_scxml_that_stands_there(folder: Path) -> None:
    result = convert("doorbell.xml", "out.scxml")
    assert result.exit_code == 0, result.stderr
    assert (folder / "out.scxml").read_text() == EXAMPLES["doorbell.scxml"]
    assert violations(EXAMPLES["doorbell.scxml"]) == []
    assert "note[N560]: SCXML has no equivalent of code that runs in every cycle" in result.stderr


@pytest.mark.parametrize("name", ["doorbell.scxml", "by_its_root.xml"])
def test_the_scxml_is_read_as_the_document_that_stands_there(folder: Path, name: str) -> None:
    (folder / name).write_text(EXAMPLES["doorbell.scxml"])
    result = convert(name, "-")
    assert result.exit_code == 0, result.stderr
    assert result.stdout == EXAMPLES["doorbell.xml"]
    assert result.stderr == ""


def test_what_is_no_scxml_is_an_error_and_nothing_is_written(folder: Path) -> None:
    (folder / "no.scxml").write_text("<VisualHFSM/>")
    result = convert("no.scxml", "out.xml")
    assert result.exit_code == 1
    assert "error[E561]" in result.stderr
    assert not (folder / "out.xml").exists()
