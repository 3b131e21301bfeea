"""The border between the core and the plug-ins of ROS: what each takes of the other."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from hfsm_runtime.kinds import Kind
from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tools.workspace import DISTRIBUTIONS
from visualhfsm_ros2 import components

PLUGINS = ("visualhfsm_ros2", "zenoh_ros2")
CHECK = """
import sys
sys.path = {path!r}
from visualhfsm.__main__ import main
sys.argv = ["visualhfsm", "check", {document!r}]
main()
"""


def test_the_kind_is_one() -> None:
    kind: Kind = components  # which mypy checks
    assert all(
        callable(getattr(kind, name)) for name in ("opened", "imitated", "recorded", "replayed", "stop")
    )


@pytest.mark.slow
def test_where_the_folder_is_deleted_a_document_with_ros_says_what_to_install(tmp_path: Path) -> None:
    for package in (path for each in DISTRIBUTIONS for path in each.packages):
        if package.name not in PLUGINS:
            (tmp_path / package.name).symlink_to(package)
    there = [str(tmp_path), *(path for path in sys.path if not is_source(path))]
    program = CHECK.format(path=there, document=str(ROOT / "examples/turtlebot/bump_and_go.xml"))
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=RUN_LIMIT, check=False
    )
    assert done.returncode == 1, done.stderr
    errors = [line for line in done.stdout.splitlines() + done.stderr.splitlines() if "error" in line]
    assert any("E535" in line and "pip install 'visualhfsm[ros2]'" in line for line in errors), errors
    assert "Traceback" not in done.stderr


def is_source(path: str) -> bool:
    """Return whether an entry of the path is in the checkout, and none of its environment."""
    return Path(path).resolve().is_relative_to(ROOT) and ".venv" not in path
