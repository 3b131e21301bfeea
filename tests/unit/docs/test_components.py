"""docs/reference/components.md: its example is generated and its test passes, and its table has every option."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from codegen.hfsm._checks.component import STANDARD_OPTIONS
from tests.support.codegen_command import ROOT, codegen
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS, blocks_of

PAGE = (DOCS / "reference/components.md").read_text("utf-8")


@pytest.mark.slow
def test_the_example_is_generated_and_its_test_passes(tmp_path: Path) -> None:
    for block in blocks_of(PAGE):
        if block.name:
            (tmp_path / block.name).write_text(block.text)
    assert codegen("follow_wall.xml", cwd=tmp_path).returncode == 0
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_follow_wall.py"],
        cwd=tmp_path,
        env={"PYTHONPATH": f"{ROOT}:{tmp_path}"},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout


def test_the_table_has_every_standard_option() -> None:
    hooks = pytest.importorskip("docs.hooks", reason="needs the packages of visualhfsm[docs]")
    shown = "\n".join([hooks.component(), *hooks.shared_options(), "--help"])
    reported = set(re.findall(r"--([a-z-]+)", shown))
    assert "<!-- generated: component -->" in PAGE
    assert {name.replace("_", "-") for name in STANDARD_OPTIONS} <= reported
