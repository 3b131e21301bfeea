"""The pages of errors: every code has an entry, and every example gives exactly its code."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import pytest

from codegen._idl import compile_interfaces
from codegen._idl.report import Code as InterfaceCode
from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from codegen.hfsm.codes import Code
from codegen.hfsm.formats.others import writable_formats
from codegen.hfsm.loading import check_document
from tests.support.pages import Block, Section, sections_of
from tests.support.places import ROOT
from tests.support.plugins import OF_THE_WHOLE, OLD_DOCUMENTS, needs
from visualhfsm._document.conversion import convert_document

INTERFACES, DOCUMENTS = (
    {section.title.partition(":")[0]: section for section in sections_of(f"reference/{page}-errors.md")}
    for page in ("idl", "document")
)


def test_every_code_has_an_entry_and_every_entry_a_code() -> None:
    assert sorted(INTERFACES) == sorted(InterfaceCode)
    assert set(DOCUMENTS) == {code for code in Code if code[1] == "5"}


@OF_THE_WHOLE
def test_every_code_is_reported_somewhere() -> None:
    folders = ROOT / "codegen" / "hfsm", *ROOT.glob("plugins/*/src"), ROOT / "visualhfsm" / "_document"
    paths = [path for folder in folders for path in folder.rglob("*.py")]
    sources = "".join(path.read_text("utf-8") for path in paths)
    assert {code for code in Code if f"Code.{code.name}" not in sources} == set()


def test_an_example_of_interfaces_brings_its_code_alone(tmp_path: Path) -> None:
    assert wrong(INTERFACES, tmp_path) == {}


@OLD_DOCUMENTS
@needs("visualhfsm_ros2")
@pytest.mark.slow
def test_an_example_of_documents_brings_its_code_alone(tmp_path: Path) -> None:
    assert wrong(DOCUMENTS, tmp_path) == {}


def wrong(sections: dict[str, Section], directory: Path) -> dict[str, str]:
    """Return what the examples bring that do not bring their code alone."""
    found = {}
    for code, section in sections.items():
        assert section.blocks, code
        folder = directory / code
        folder.mkdir()
        written = [write(block, folder) for block in section.blocks if block.language != "console"]
        commands = [block.text.split()[1:] for block in section.blocks if block.language == "console"]
        diagnostics = run(commands[0] if commands else [], written, folder)
        if {each.code for each in diagnostics} != {code}:
            found[code] = diagnostics.render()
    return found


def write(block: Block, folder: Path) -> Path:
    """Write an example to its file."""
    encoding, text = "utf-8", block.text
    match block.info.split():
        case ["python", "generates", name]:
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                exec(block.text, {})
            text = output.getvalue()
        case ["idl" | "xml" | "python" as language, *encodings]:
            name = block.name or f"main.{language}"
            encoding = encodings[0] if encodings else encoding
        case _:
            raise AssertionError(f"an example cannot be {block.info}")
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(text.encode(encoding))
    return path


def run(command: list[str], written: list[Path], folder: Path) -> Diagnostics:
    """Return what the command of an example reports, by default that which compiles what was written."""
    diagnostics = Diagnostics()
    files = [folder / word for word in command if "." in word and not word.startswith("-")]
    interfaces = [path for path in (*files, *written) if path.suffix == ".idl"]
    if interfaces:
        compile_interfaces([*dict.fromkeys(interfaces)], [], None, diagnostics)
    elif command[:2] == ["visualhfsm", "convert"]:
        source, target, *_ = *files, folder / "out.xml"
        to = writable_formats().get(target.suffix)
        convert_document(source, diagnostics, to=to, fixes_python2="--fix-python2" in command)
    elif command[:2] == ["visualhfsm", "check"]:
        check_document(files[-1], diagnostics)
    else:
        compile_document(files[-1] if files else folder / "main.xml", None, diagnostics)
    return diagnostics
