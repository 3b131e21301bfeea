"""Unit tests lie where what they test lies: tests/unit/codegen/idl/test_parser.py tests codegen/idl/parser.py."""

from __future__ import annotations

import ast
import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Final

from tests.support.places import ROOT

UNIT: Final = ROOT / "tests" / "unit"
GENERATED: Final = {"interfaces", "behaviors"}
ELSEWHERE: Final = {"docs": "docs", "support": "tests/support"}
"""Folders of tests of what is no package."""
THROUGH_OTHERS: Final = UNIT / "tested_through_others.txt"
"""Modules without their own test: they are tested through the public interface of another module."""

IMPORT: Final = re.compile(r"^ *((?:from [\w.]+ )?import (?:\([^)]*\)|.*))", re.MULTILINE)
"""A statement that imports; parsing these alone takes a tenth of the time."""


def packages() -> list[Path]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    return [ROOT / name for name in project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]]


@cache
def imported_by_tests() -> frozenset[str]:
    """Return the names of all modules that tests import directly."""
    found: set[str] = set()
    for path in (ROOT / "tests").rglob("test_*.py"):
        statements = IMPORT.findall(path.read_text("utf-8"))
        for node in ast.parse("\n".join(statements)).body:
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module is not None:
                found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return frozenset(found)


def modules_without_a_test() -> set[str]:
    """Return the modules that have no test of their name and that no test imports."""
    found: set[str] = set()
    for package in packages():
        for path in package.rglob("*.py"):
            place = path.relative_to(ROOT)
            if package.name in GENERATED or path.stem in {"__init__", "__main__"}:
                continue
            own = UNIT / place.parent / f"test_{path.stem.lstrip('_')}.py"
            if not own.exists() and ".".join(place.with_suffix("").parts) not in imported_by_tests():
                found.add(str(place))
    return found


def test_every_folder_of_tests_is_that_of_a_folder() -> None:
    folders = {path.parent.relative_to(UNIT) for path in UNIT.rglob("test_*.py")} - {Path()}
    lost = [folder for folder in folders if not (ROOT / ELSEWHERE.get(str(folder), folder)).is_dir()]
    assert not lost, f"no folder of the project is tested by {lost}: move these tests to what they test"


def test_modules_without_a_test_of_their_own_are_known() -> None:
    known = set(THROUGH_OTHERS.read_text("utf-8").split())
    found = modules_without_a_test()
    new, tested = sorted(found - known), sorted(known - found)
    assert not new, f"without their own test: {new}; write tests/unit/PACKAGE/test_MODULE.py"
    assert not tested, f"{tested} have their own tests, or are gone: remove them from {THROUGH_OTHERS.name}"
