"""The page that leads the user's browser to the editor: who can read it, and when it is removed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.limits import END_LIMIT
from tests.support.processes import REPOSITORY
from visualhfsm._editor.launch import LaunchPage

ADDRESS = "http://127.0.0.1:8800/?token=abc"

KILLED = f"""
import os, signal
from visualhfsm._editor.launch import LaunchPage
page = LaunchPage({ADDRESS!r})
print(page.path, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's runtime directory."""
    runtime = tmp_path / "runtime"
    runtime.mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    return runtime


def test_only_the_user_can_read_it_and_it_is_removed(runtime: Path) -> None:
    former = os.umask(0)
    page = LaunchPage(ADDRESS)
    try:
        assert page.path.is_relative_to(runtime)
        assert [each.stat().st_mode & 0o777 for each in (page.path, page.path.parent)] == [0o600, 0o700]
        assert f"url={ADDRESS}" in page.path.read_text()
    finally:
        os.umask(former)
        page.close()
    assert not page.is_open
    assert not [*runtime.iterdir()]
    page.close()


@pytest.mark.parametrize("mode", [0o755, None])
def test_a_runtime_directory_that_others_can_enter_or_that_is_missing_is_not_used(
    tmp_path: Path, runtime: Path, monkeypatch: pytest.MonkeyPatch, mode: int | None
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    if mode is None:
        runtime.rmdir()
    else:
        runtime.chmod(mode)
    page = LaunchPage(ADDRESS)
    try:
        assert page.path.parent.parent == tmp_path
        assert page.path.parent.stat().st_mode & 0o777 == 0o700
    finally:
        page.close()


@pytest.mark.slow
def test_the_next_start_removes_what_a_killed_editor_left_behind_and_no_other(runtime: Path) -> None:
    killed = subprocess.run(
        [sys.executable, "-c", KILLED],
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        text=True,
        timeout=END_LIMIT,
        check=False,
    )
    assert killed.returncode == -signal.SIGKILL
    left = Path(killed.stdout.strip())
    assert left.exists()
    former = LaunchPage(ADDRESS)
    try:
        assert left.exists()  # it may be one that is just being made
        for page in (left, former.path):
            os.utime(page.parent, (0, 0))
        LaunchPage(ADDRESS).close()
        assert [each.name for each in runtime.iterdir()] == [former.path.parent.name]
        assert former.path.exists()
    finally:
        former.close()
