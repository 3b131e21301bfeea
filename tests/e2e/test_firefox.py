"""The page in Firefox: a walk through what users do, which `make soak` takes where Firefox is installed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.editor import DOCUMENT
from tests.support.limits import RUN_LIMIT
from tests.support.monitor import robot_and_editor
from tests.support.processes import REPOSITORY

PAGE = REPOSITORY / "tests" / "page"
FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")


@pytest.mark.soak("tests/e2e/test_editor_experiment.py")
@pytest.mark.skipif(FIREFOX is None, reason="needs Firefox: apt-get install firefox-esr")
@pytest.mark.skipif(shutil.which("node") is None, reason="Node.js is not installed")
@pytest.mark.skipif(
    not (PAGE / "node_modules" / "puppeteer-core").exists(),
    reason="needs puppeteer-core: make soak installs it",
)
def test_the_page_is_used_in_firefox(tmp_path: Path) -> None:
    with robot_and_editor(tmp_path / "walk.xml", DOCUMENT) as (_, running):
        done = subprocess.run(
            ["node", "walk.js", str(FIREFOX), running.server.new_address()],
            cwd=PAGE, capture_output=True, text=True, timeout=RUN_LIMIT, check=False,
        )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
