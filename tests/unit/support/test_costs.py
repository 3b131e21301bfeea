"""At its end a run says what cost most."""

from __future__ import annotations

import os
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
    len(bytearray(times * 25_000_000))
"""
WAITS = """
import time
def test_waits(): time.sleep(0.2)
"""
USES = "def test_uses(helper): assert helper.stdout.readline()"
LEAVES = "def test_leaves(helper): pass"
CONFTEST = """
import subprocess, sys
import pytest
from tests.support.costs import Costs
def pytest_configure(config): config.pluginmanager.register(Costs())
@pytest.fixture(scope="session")
def helper():
    code = "for _ in range(10_000_000): pass\\nprint(flush=True); input()"
    helper = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    with helper: yield helper
"""


@pytest.mark.slow
def test_files_are_named_by_the_processor_time_of_their_tests(tmp_path: Path) -> None:
    files = {
        "test_a_waits.py": WAITS,
        "test_b_works.py": WORKS,
        "test_c_uses.py": USES,
        "test_d_leaves.py": LEAVES,
    }
    for name, code in {**files, "conftest.py": CONFTEST}.items():
        (tmp_path / name).write_text(code)
    words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(tmp_path), str(tmp_path)]
    environment = {name: value for name, value in os.environ.items() if name != "TEST_TIER"}
    run = subprocess.run(
        [sys.executable, *words], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr
    rows = re.findall(r"^ *([\d.]+) s +([\d.]+) s +(\d+)  (\S+)$", run.stdout, re.MULTILINE)
    assert {file: tests for _, _, tests, file in rows} == {
        name: "20" if "works" in name else "1" for name in files
    }
    assert [float(row[0]) for row in rows] == sorted((float(row[0]) for row in rows), reverse=True)
    assert {row[3] for row in rows[:2]} == {"test_b_works.py", "test_c_uses.py"}
    processor, wall = next(map(float, row[:2]) for row in rows if row[3] == "test_a_waits.py")
    assert processor < 0.2 <= wall
    assert re.search(
        r"^largest process \d+ MB of 600, since test_b_works.py::test_works\[4\]$", run.stdout, re.MULTILINE
    )
    assert re.search(
        r"^the processes of the tests grew most by \d{2,} MB in test_b_works.py, ", run.stdout, re.MULTILINE
    )
