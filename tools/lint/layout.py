"""A module's tests are found by its name: tests/unit/codegen/idl/test_parser.py tests codegen/_idl/parser.py.

Where one file would be too long, each topic of a module has its own: test_parser_comments.py also tests
parser.py. What a package does as a whole is tested under the name of the package, and a plug-in in
plugins/NAME/tests/integration.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

from tools.lint.sources import PROJECT, ROOT, TEST_FOLDERS, TESTS
from tools.workspace import DISTRIBUTIONS

GENERATED: Final = {"interfaces", "behaviors"}
TESTED_BY: Final = {
    "nao_tools/_listing.py": "integration/test_nao_command.py",
    "nao_tools/_status.py": "integration/test_nao_command.py",
    "visualhfsm/_monitor/recorder.py": "integration/test_live_recordings.py",
    "visualhfsm/testing/_coverage.py": "unit/visualhfsm/testing/test_plugin.py",
    "visualhfsm/testing/_results.py": "unit/visualhfsm/testing/test_plugin.py",
}
"""Modules whose tests have other names, each with the file in tests/ that checks it most."""

IMPORT: Final = re.compile(r"^ *((?:from [\w.]+ )?import (?:\([^)]*\)|[\w*].*))", re.MULTILINE)
"""A statement that imports; parsing these alone takes a tenth of the time."""


def _modules() -> Iterator[Path]:
    """Yield the files of the modules of the wheel that are written by hand."""
    for package in (path for each in DISTRIBUTIONS for path in each.packages):
        if package.name not in GENERATED:
            for path in package.rglob("*.py"):
                is_part = (path.parent / "__init__.py").exists()  # and no file that `visualhfsm new` copies
                if is_part and path.stem not in {"__init__", "__main__"}:
                    yield path.relative_to(ROOT)


def _name_of(module: Path) -> str:
    """Return the name by which the file of a module is imported."""
    parts = module.with_suffix("").parts
    return ".".join(parts[3:] if parts[0] == "plugins" else parts)


def _has_logic(module: Path) -> bool:
    """Return whether a function of a module does something: it is more than data, types and protocols."""
    return any(
        not (
            isinstance(statement, ast.Pass)
            or (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant))
        )
        for node in ast.walk(ast.parse((ROOT / module).read_text("utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        for statement in node.body
    )


def _is_found(module: Path) -> bool:
    """Return whether a test file is named after a module, or after a package in which it is."""
    if module.parts[0] == "plugins" and any(
        ROOT.glob(f"plugins/{module.parts[1]}/tests/integration/test_*.py")
    ):
        return True
    return any(name.lstrip("_") in _names_of_tests() for name in (*module.parts[1:-1], module.stem))


@cache
def _names_of_tests() -> frozenset[str]:
    """Return what test files are named after: `parser` and `parser_comments` for test_parser_comments.py."""
    words = [path.stem.split("_")[1:] for folder in TEST_FOLDERS for path in folder.rglob("test_*.py")]
    return frozenset("_".join(each[:end]) for each in words for end in range(1, len(each) + 1))


@cache
def _imported_by_tests() -> frozenset[str]:
    """Return the names of all modules that tests import directly."""
    found: set[str] = set()
    for path in (path for folder in TEST_FOLDERS for path in folder.rglob("test_*.py")):
        statements = IMPORT.findall(path.read_text("utf-8"))
        for node in ast.parse("\n".join(statements)).body:
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module is not None:
                found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return frozenset(found)


def _named_in_configuration() -> Iterator[str]:
    """Yield the patterns of files and folders that pyproject.toml names."""
    tool = PROJECT["tool"]
    for key in ("only_mutate", "pytest_add_cli_args_test_selection", "source_paths", "also_copy"):
        yield from (
            re.sub("^src/", "plugins/makers/src/", name) for name in tool["mutmut"][key]
        )  # `make mutation` links it
    for pattern in tool["ruff"]["lint"]["per-file-ignores"]:
        yield from _alternatives(pattern)


def _alternatives(pattern: str) -> list[str]:
    """Return the patterns that one with braces, `{a,b/c}.py`, stands for."""
    before, brace, rest = pattern.partition("{")
    if not brace:
        return [pattern]
    inside, _, after = rest.partition("}")
    return [f"{before}{each}{end}" for each in inside.split(",") for end in _alternatives(after)]


def mistakes() -> Iterator[str]:
    """Yield modules without a test, exceptions that are none, and what pyproject.toml names and is gone."""
    lost = {
        str(module)
        for module in _modules()
        if not _is_found(module) and _name_of(module) not in _imported_by_tests() and _has_logic(module)
    }
    here = Path(__file__).relative_to(ROOT)
    for module in sorted(lost - TESTED_BY.keys()):
        yield f"{module}: it has no test: write tests/unit/PACKAGE/test_MODULE.py"
    for module, test in TESTED_BY.items():
        if module not in lost:
            yield f"{here}: {module} has tests, or is gone: remove it from TESTED_BY"
        if not (TESTS / test).is_file():
            yield f"{here}: tests/{test} is not there"
    for name in _named_in_configuration():
        if not any(ROOT.glob(name)):
            yield f"pyproject.toml: {name} is not there"
