"""docs/reference/document-errors.md: every code has an entry, and every example gives exactly its code."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from codegen.hfsm.codes import Code
from codegen.hfsm.formats.others import writable_formats
from codegen.hfsm.loading import check_document
from tests.support.codegen_command import ROOT
from tests.support.pages import Section, sections_of
from visualhfsm._document.conversion import convert_document

SECTIONS = {
    section.title.partition(":")[0]: section for section in sections_of("reference/document-errors.md")
}


def test_every_code_has_an_entry_and_every_entry_a_code() -> None:
    assert set(SECTIONS) == {code for code in Code if code[1] == "5"}


def test_every_code_is_reported_somewhere() -> None:
    folders = ROOT / "codegen" / "hfsm", ROOT / "plugins", ROOT / "visualhfsm" / "_document"
    paths = [path for folder in folders for path in folder.rglob("*.py")]
    sources = "".join(path.read_text("utf-8") for path in paths)
    assert {code for code in Code if f"Code.{code.name}" not in sources} == set()


@pytest.mark.slow
def test_an_example_brings_its_code_alone(tmp_path: Path) -> None:
    wrong = {}
    for code, section in SECTIONS.items():
        folder = tmp_path / code
        folder.mkdir()
        diagnostics = checked(section, folder)
        if {found.code for found in diagnostics} != {code}:
            wrong[code] = diagnostics.render()
    assert wrong == {}


def checked(section: Section, folder: Path) -> Diagnostics:
    """Write an example to a folder, and return what its command reports."""
    path = folder / "main.xml"
    command: list[str] = []
    for block in section.blocks:
        match block.info.split():
            case ["xml" | "python"]:
                (folder / (block.name or "main.xml")).write_text(block.text)
            case ["python", "generates", name]:
                output = io.StringIO()
                with contextlib.redirect_stdout(output):
                    exec(block.text, {})
                (folder / name).write_text(output.getvalue())
            case ["console"]:
                _, *command = block.text.split()
    diagnostics = Diagnostics()
    if command[:2] == ["visualhfsm", "convert"]:
        fixes = "--fix-python2" in command
        source, target, *_ = *(word for word in command[2:] if not word.startswith("-")), "out.xml"
        path = folder / source
        to = writable_formats().get(Path(target).suffix)
        convert_document(path, diagnostics, to=to, fixes_python2=fixes)
    elif command[:2] == ["visualhfsm", "check"]:
        check_document(folder / command[-1], diagnostics)
    else:
        compile_document(folder / command[-1] if command else path, None, diagnostics)
    return diagnostics
