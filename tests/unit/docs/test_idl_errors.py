"""docs/reference/idl-errors.md: every code has an entry, and every example gives exactly its code."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

from codegen._idl import compile_interfaces
from codegen._idl.report import Code
from codegen.diagnostics import Diagnostics
from tests.support.pages import Block, sections_of

SECTIONS = {section.title.partition(":")[0]: section for section in sections_of("reference/idl-errors.md")}


def test_every_code_has_an_entry_and_every_entry_a_code() -> None:
    assert sorted(SECTIONS) == sorted(Code)


def write(block: Block, directory: Path) -> Path:
    """Write an example to its file."""
    match block.info.split():
        case ["idl"]:
            path, content = directory / (block.name or "main.idl"), block.text.encode()
        case ["idl", encoding]:
            path, content = directory / "main.idl", block.text.encode(encoding)
        case ["python", "generates", name]:
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                exec(block.text, {})
            path, content = directory / name, output.getvalue().encode()
        case ["python"]:
            path, content = directory / str(block.name), block.text.encode()
        case ["console"]:
            return directory / block.text.split()[-1]
        case _:
            raise AssertionError(f"an example cannot be {block.info}")
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
    return path


def test_an_example_brings_its_code_alone(tmp_path: Path) -> None:
    wrong = {}
    for code, section in SECTIONS.items():
        assert section.blocks, code
        folder = tmp_path / code
        folder.mkdir()
        paths = [write(block, folder) for block in section.blocks]
        diagnostics = Diagnostics()
        compile_interfaces([path for path in paths if path.suffix == ".idl"], [], None, diagnostics)
        if {found.code for found in diagnostics} != {code}:
            wrong[code] = diagnostics.render()
    assert wrong == {}
