"""Generated source is formatted as the formatter of the project would."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from codegen._idl import compile_interfaces
from codegen.diagnostics import Diagnostics
from codegen.files import apply, compare_with_disk
from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.slice_compiler import AWKWARD, write_sources


@pytest.mark.slow
def test_awkward_names_pass_the_formatter(tmp_path: Path) -> None:
    paths = write_sources(tmp_path / "idl", AWKWARD)
    compilation = compile_interfaces(paths, [], tmp_path / "out", Diagnostics())
    apply(compare_with_disk(compilation.files))
    for command in (
        ["ruff", "format", "--isolated", "--line-length", "110", "--diff", str(tmp_path / "out")],
        ["ruff", "check", "--isolated", "--select", "F,E9,RUF022", str(tmp_path / "out")],
    ):
        done = subprocess.run(
            [sys.executable, "-m", *command],
            capture_output=True,
            text=True,
            timeout=RUN_LIMIT,
            cwd=ROOT,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
