"""What `nao doctor` says of computers that cannot contain submissions."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.broken_machines import broken, examined

pytestmark = pytest.mark.slow

NO_NAMESPACES = "echo 0 > /proc/sys/user/max_user_namespaces"


def test_bubblewrap_that_is_missing_is_a_note_for_those_who_grade() -> None:
    line = examined([], PATH="/nonexistent").having("grading: ")
    assert line.startswith("note grading: bubblewrap is missing")
    assert line.endswith("where submissions are graded: sudo apt-get install bubblewrap")


def test_bubblewrap_that_may_not_work_is_a_warning(tmp_path: Path) -> None:
    line = examined(broken(tmp_path, NO_NAMESPACES, needs=("bwrap",))).having("grading: ")
    assert line.startswith("warn grading: bubblewrap cannot make walls here")
    assert "and allow user namespaces" in line
