"""Directories for a while do not stay behind, however their process ends."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from tests.support.limits import LIMIT
from tests.support.processes import REPOSITORY
from visualhfsm.scratch import ScratchDirectory, delete_abandoned

OWNER = """
import sys
from visualhfsm.scratch import ScratchDirectory

directory = ScratchDirectory()
print(directory.path, flush=True)
sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_only_what_a_dead_process_left_is_deleted(temporary: Path) -> None:
    ours = ScratchDirectory()
    elsewhere = temporary / "elsewhere"
    elsewhere.mkdir()
    others = [
        temporary / "visualhfsm-scratch-link",
        temporary / "visualhfsm-scratch-new",
        temporary / "visualhfsm-1",
    ]
    others[0].symlink_to(elsewhere)
    (elsewhere / ".lock").touch()
    others[1].mkdir()
    others[2].mkdir()
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER],
        cwd=REPOSITORY,
        env={**os.environ, "TMPDIR": str(temporary)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with owner:
        assert owner.stdout is not None
        abandoned = Path(owner.stdout.readline().strip())
        (abandoned / "walk.py").write_text("pass")
        delete_abandoned()
        assert abandoned.parent == temporary
        assert abandoned.is_dir()
        owner.kill()
        owner.wait(LIMIT)
    delete_abandoned()
    assert not abandoned.exists()
    assert ours.path.is_dir()
    assert all(other.is_dir() for other in others)
    ours.close()
    assert not ours.path.exists()
