"""At its end a run says what cost most."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.places import ROOT

WORKS = """
import pytest
@pytest.mark.parametrize("times", [4, *19 * [0]])
def test_works(times):
    for _ in range(times * 1_000_000): pass
"""
WAITS = """
import time
def test_waits(): time.sleep(0.2)
"""
CONFTEST = "from tests.support.costs import Costs\ndef pytest_configure(config): config.pluginmanager.register(Costs())"


@pytest.mark.slow
def test_files_are_named_by_the_processor_time_of_their_tests(tmp_path: Path) -> None:
    for name, code in {"test_a_waits.py": WAITS, "test_b_works.py": WORKS, "conftest.py": CONFTEST}.items():
        (tmp_path / name).write_text(code)
    words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(tmp_path), str(tmp_path)]
    run = subprocess.run([sys.executable, *words], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    rows = re.findall(r"^ *([\d.]+) s +([\d.]+) s +(\d+)  (\S+)$", run.stdout, re.MULTILINE)
    assert [(tests, file) for _, _, tests, file in rows] == [
        ("20", "test_b_works.py"),
        ("1", "test_a_waits.py"),
    ]
    assert float(rows[1][0]) < 0.2 <= float(rows[1][1])
    assert re.search(
        r"^largest process \d+ MB of 700, since test_a_waits.py::test_waits$", run.stdout, re.MULTILINE
    )
