"""The last limit of a test, which ends its process: it needs neither the main thread nor the interpreter."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.processes import REPOSITORY
from tests.support.soak import cases

CONFTEST = """
import tests.support.suite
from tests.support.suite import pytest_configure, pytest_exception_interact, pytest_runtest_protocol

tests.support.suite.TEST_LIMIT, tests.support.suite.LAST_LIMIT = 240.0, 1.0 - 240.0
"""
HANGING = {
    # The C library takes no signal for an end of this wait.
    "library": """
import ctypes

def test_it():
    lock = ctypes.create_string_buffer(64)
    for _ in range(2):
        ctypes.CDLL(None).pthread_mutex_lock(lock)
""",
    "interpreter": """
import ctypes

def test_it():
    lock = ctypes.create_string_buffer(64)
    for _ in range(2):
        ctypes.PyDLL(None).pthread_mutex_lock(lock)  # keeps the interpreter
""",
    "teardown": """
import threading
import pytest

@pytest.fixture
def endless():
    yield
    threading.Event().wait()

def test_it(endless):
    assert False
""",
}
"""Tests that no exception ends, by the name of their file."""


# What keeps the interpreter keeps the main thread, too.
@pytest.mark.parametrize("name", cases(["interpreter", "teardown"], ["library"]))
def test_what_no_exception_ends_is_named_and_shown(tmp_path: Path, name: str) -> None:
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / f"test_{name}.py").write_text(HANGING[name])
    done = subprocess.run(
        # One worker: what several write to the standard error at once is mixed.
        [sys.executable, "-m", "pytest", "-n", "1", "-p", "no:cacheprovider"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    crash = re.compile(r"^worker 'gw\d' crashed while running 'test_(\w+).py::test_it'", re.MULTILINE)
    line = re.compile(r'^  File ".*/test_(\w+).py", line \d+ in \w+$', re.MULTILINE)
    assert done.returncode == 1
    assert set(crash.findall(done.stdout)) == set(line.findall(done.stderr)) == {name}
