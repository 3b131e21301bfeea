"""The tests of a module are found by its name: tests/unit/codegen/idl/test_parser.py tests codegen/_idl/parser.py.

Where one file would be too long, each topic of a module has its own: test_parser_comments.py also tests parser.py.
What a package does as a whole is tested under the name of the package, and a plug-in in tests/plugins/NAME/integration.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

import pytest

from tests.support.places import ROOT

TESTS: Final = ROOT / "tests"
GENERATED: Final = {"interfaces", "behaviors"}
TESTED_BY: Final = {
    "nao_tools/_call.py": "integration/test_nao_command.py",
    "nao_tools/_listing.py": "integration/test_nao_command.py",
    "nao_tools/_status.py": "integration/test_nao_command.py",
    "naoserver/soccer_field/_obstacles.py": "unit/naoserver/soccer_field/test_localization.py",
    "naoserver/soccer_field/_panorama.py": "unit/naoserver/soccer_field/test_localization.py",
    "naoserver/soccer_field/_picture.py": "unit/naoserver/soccer_field/test_localization.py",
    "visualhfsm/_monitor/recorder.py": "integration/test_live_recordings.py",
}
"""Modules whose tests have other names, each with the file in tests/ that checks it most."""

IMPORT: Final = re.compile(r"^ *((?:from [\w.]+ )?import (?:\([^)]*\)|.*))", re.MULTILINE)
"""A statement that imports; parsing these alone takes a tenth of the time."""


def modules() -> Iterator[Path]:
    """Yield the files of the modules of the wheel that are written by hand."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    for package in project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]:
        if package not in GENERATED:
            for path in (ROOT / package).rglob("*.py"):
                is_part = (path.parent / "__init__.py").exists()  # and no file that `visualhfsm new` copies
                if is_part and path.stem not in {"__init__", "__main__"}:
                    yield path.relative_to(ROOT)


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


def is_found(module: Path) -> bool:
    """Return whether a test file is named after a module, or after a package in which it is."""
    if module.parts[0] == "plugins" and any((TESTS / Path(*module.parts[:2])).glob("integration/test_*.py")):
        return True
    return any(name.lstrip("_") in names_of_tests() for name in (*module.parts[1:-1], module.stem))


@cache
def names_of_tests() -> frozenset[str]:
    """Return what test files are named after: `parser` and `parser_comments` for test_parser_comments.py."""
    words = [path.stem.split("_")[1:] for path in TESTS.rglob("test_*.py")]
    return frozenset("_".join(each[:end]) for each in words for end in range(1, len(each) + 1))


@cache
def imported_by_tests() -> frozenset[str]:
    """Return the names of all modules that tests import directly."""
    found: set[str] = set()
    for path in TESTS.rglob("test_*.py"):
        statements = IMPORT.findall(path.read_text("utf-8"))
        for node in ast.parse("\n".join(statements)).body:
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module is not None:
                found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return frozenset(found)


@pytest.mark.slow
def test_the_tests_of_a_module_are_found() -> None:
    lost = {
        str(module)
        for module in modules()
        if not is_found(module)
        and ".".join(module.with_suffix("").parts).removeprefix("plugins.") not in imported_by_tests()
        and has_logic(module)
    }
    new, gone = sorted(lost - set(TESTED_BY)), sorted(set(TESTED_BY) - lost)
    assert not new, f"without a test: {new}; write tests/unit/PACKAGE/test_MODULE.py"
    assert not gone, f"{gone} have tests, or are gone: remove them from TESTED_BY"
    assert [path for path in TESTED_BY.values() if not (TESTS / path).is_file()] == []


def test_the_configuration_names_files_that_are_there() -> None:
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]
    mutated = tool["mutmut"]
    patterns = [
        *tool["ruff"]["lint"]["per-file-ignores"],
        *mutated["only_mutate"],
        *mutated["pytest_add_cli_args_test_selection"],
    ]
    named = [name for pattern in patterns for name in alternatives(pattern)]
    assert [name for name in named if not any(ROOT.glob(name))] == []


def alternatives(pattern: str) -> list[str]:
    """Return the patterns that one with braces, `{a,b/c}.py`, stands for."""
    before, brace, rest = pattern.partition("{")
    if not brace:
        return [pattern]
    inside, _, after = rest.partition("}")
    return [f"{before}{each}{end}" for each in inside.split(",") for end in alternatives(after)]
