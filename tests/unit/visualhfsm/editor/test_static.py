"""The unit tests of the page, which run in Node.js."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT

PAGE = ROOT / "tests" / "page"


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("node") is None, reason="Node.js is not installed")
def test_the_page_passes_its_unit_tests() -> None:
    done = subprocess.run(
        ["node", "run-tests.js"], cwd=PAGE, capture_output=True, text=True, timeout=RUN_LIMIT, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
