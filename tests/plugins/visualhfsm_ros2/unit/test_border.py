"""The border between the core and the plug-ins of ROS: what each takes of the other."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from hfsm_runtime.kinds import Kind
from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from visualhfsm_ros2 import components

PLUGINS = ("visualhfsm_ros2", "zenoh_ros2")
CORE = (
    *("ballmover", "codegen", "hfsm_runtime", "interfaces", "nao_tools"),
    *("naoserver", "naoserver_sim", "visualhfsm", "zenoh_ice"),
)
CHECK = """
import sys
sys.path = {path!r}
from visualhfsm.__main__ import main
sys.argv = ["visualhfsm", "check", {document!r}]
main()
"""


def imported(path: Path) -> Iterator[str]:
    """Yield the dotted names that a module imports, those of its own package without their dots."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            yield from (f"{node.module}.{each.name}" for each in node.names)


def modules(*folders: str) -> list[Path]:
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def test_nothing_private_of_the_core_is_imported() -> None:
    found = [
        (path.name, name)
        for path in modules(*(f"plugins/{each}" for each in PLUGINS))
        for name in imported(path)
        if name.split(".")[0] in CORE and any(part.startswith("_") for part in name.split(".")[1:])
    ]
    assert found == []


@pytest.mark.slow
def test_tests_of_the_core_import_nothing_of_ros() -> None:
    tests = modules("tests/unit", "tests/integration", "tests/faults", "tests/e2e")
    assert tests
    found = [path.name for path in tests for name in imported(path) if name.split(".")[0] in PLUGINS]
    assert found == []


def test_the_kind_is_one() -> None:
    kind: Kind = components  # which mypy checks
    assert all(
        callable(getattr(kind, name)) for name in ("opened", "imitated", "recorded", "replayed", "stop")
    )


@pytest.mark.slow
def test_where_the_folder_is_deleted_a_document_with_ros_says_what_to_install(tmp_path: Path) -> None:
    for package in CORE:
        (tmp_path / package).symlink_to(ROOT / package)
    for path in (ROOT / "plugins").iterdir():  # others are deleted by their own tests
        if path.name not in PLUGINS:
            (tmp_path / path.name).symlink_to(path)
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
