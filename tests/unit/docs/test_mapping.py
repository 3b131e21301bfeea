"""The example of docs/reference/mapping.md is the output of codegen."""

from __future__ import annotations

import re
from pathlib import Path

from tests.support.places import ROOT
from tests.support.slice_compiler import compile_text

PAGE = ROOT / "docs" / "reference/mapping.md"


def test_the_example_is_what_is_generated(tmp_path: Path) -> None:
    slice_text, python, *_ = re.findall(r"```(?:slice|python)\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    compilation, diagnostics = compile_text(tmp_path, slice_text)
    assert not diagnostics.has_errors, diagnostics.render()
    text = next(file.text for file in compilation.files if file.path.name == "main.py")
    generated = text.splitlines()
    position = 0
    for line in filter(None, python.splitlines()):
        assert line in generated[position:], f"{line!r} is not generated there"
        position = generated.index(line, position) + 1
