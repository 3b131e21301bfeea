"""Unit tests are found by name: tests/unit/codegen/idl/test_parser.py tests codegen/_idl/parser.py.

Where one file would be too long, each topic of a module has its own: test_parser_comments.py also tests parser.py.
What a package does as a whole is tested in its folder or the one above, under the name of the package.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

from tests.support.places import ROOT

UNIT: Final = ROOT / "tests" / "unit"
GENERATED: Final = {"interfaces", "behaviors"}
FREE: Final = {Path("repository"), Path("docs")}
"""Folders of tests of the repository itself and of its pages, which are named after no module."""
ELSEWHERE: Final = {Path("support"): Path("tests", "support")}
"""Folders of tests of what is no package."""
THROUGH_OTHERS: Final = Path(__file__).with_name("tested_through_others.txt")
"""Modules that no test file is named after and no test imports, each with the test files that check it."""

IMPORT: Final = re.compile(r"^ *((?:from [\w.]+ )?import (?:\([^)]*\)|.*))", re.MULTILINE)
"""A statement that imports; parsing these alone takes a tenth of the time."""


def subjects(folder: Path) -> set[str]:
    """Return what the tests of a folder may be named after: its modules, the packages in it, and the folder."""
    modules = {path.stem.lstrip("_") for path in folder.glob("*.py")} - {"init__", "main__"}
    return (
        {folder.name.lstrip("_")}
        | modules
        | {path.name.lstrip("_") for path in folder.iterdir() if path.is_dir()}
    )


def public(path: Path) -> Path:
    """Return a path as tests write it: without the underscores before what belongs to one package alone."""
    return Path(*(part.lstrip("_") for part in path.parts))


def folder_of_subjects(folder: Path) -> Path:
    """Return the folder whose modules the tests of a folder test, whether or not underscores begin its parts."""
    found = ROOT
    for part in ELSEWHERE.get(folder, folder).parts:
        found = next((path for path in (found / f"_{part}", found / part) if path.is_dir()), found / part)
    return found


def is_named_after(test: str, subject: str) -> bool:
    """Return whether a test file, without its suffix, is named after a module, or after a topic of it."""
    return f"{test}_".startswith(f"test_{subject}_")


def modules() -> Iterator[Path]:
    """Yield the files of the modules of the wheel that are written by hand."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    for package in project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]:
        if package not in GENERATED:
            for path in (ROOT / package).rglob("*.py"):
                is_part = (path.parent / "__init__.py").exists()  # and no file that `visualhfsm new` copies
                if is_part and path.stem not in {"__init__", "__main__"}:
                    yield path.relative_to(ROOT)


def has_own_test(module: Path) -> bool:
    subject = module.stem.lstrip("_")
    return any(
        is_named_after(path.stem, subject)
        for path in (UNIT / public(module.parent)).glob(f"test_{subject}*.py")
    )


def has_logic(module: Path) -> bool:
    """Return whether a module has a function that does something, and so more than data, types and protocols."""
    return any(
        not (
            isinstance(statement, ast.Pass)
            or (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant))
        )
        for node in ast.walk(ast.parse((ROOT / module).read_text("utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        for statement in node.body
    )


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


def listed_modules() -> dict[Path, list[Path]]:
    """Return the modules in the list with the test files that check them."""
    lines = THROUGH_OTHERS.read_text("utf-8").splitlines()
    entries = [line.split(":") for line in lines if line and not line.startswith("#")]
    return {Path(module): [ROOT / "tests" / each for each in tests.split()] for module, tests in entries}


def test_every_unit_test_file_is_named_after_what_it_tests() -> None:
    lost = []
    for path in UNIT.rglob("test_*.py"):
        folder = path.parent.relative_to(UNIT)
        tested = folder_of_subjects(folder)
        if folder not in FREE and not (
            tested.is_dir() and any(is_named_after(path.stem, subject) for subject in subjects(tested))
        ):
            lost.append(str(path.relative_to(ROOT)))
    assert not lost, (
        f"named after no module: {sorted(lost)}; name them test_MODULE.py or test_MODULE_TOPIC.py"
    )


def test_modules_without_a_test_of_their_own_are_known() -> None:
    known = set(listed_modules())
    found = {
        module
        for module in modules()
        if not has_own_test(module)
        and ".".join(module.with_suffix("").parts) not in imported_by_tests()
        and has_logic(module)
    }
    new, tested = sorted(map(str, found - known)), sorted(map(str, known - found))
    assert not new, f"without a test: {new}; write tests/unit/PACKAGE/test_MODULE.py"
    assert not tested, f"{tested} have tests, or are gone: remove them from {THROUGH_OTHERS.name}"


def test_a_module_that_is_tested_through_others_names_their_tests() -> None:
    lost = {
        str(module): [str(path) for path in tests if not path.is_file()]
        for module, tests in listed_modules().items()
    }
    assert all(listed_modules().values()), f"say in {THROUGH_OTHERS.name} which tests check each module"
    assert not any(lost.values()), f"no such tests: {lost}"
