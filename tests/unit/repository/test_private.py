"""What only its own package uses begins with an underscore, and no other package uses that."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from typing import Final

import grimp
import pytest

from tests.support.places import ROOT

GENERATED: Final = "interfaces"
NAMED_ON_PAGES: Final = re.compile(
    r"""(?:from\ |import\ |:::\ |python\ -m\ |--pyargs\ |gymnasium\.make\w*\(")([a-z_0-9]+(?:\.[a-z_0-9]+)*)""",
    re.VERBOSE,
)
"""A module that pages and examples name: as an import, as a command, as tests, as environments,
or in the reference of the API."""


@cache
def graph() -> grimp.ImportGraph:
    """Return who imports whom, in the packages of the wheel and in the behaviors."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    return grimp.build_graph(*project["tool"]["importlinter"]["root_packages"], cache_dir=None)


@cache
def named_on_pages() -> frozenset[str]:
    paths = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    for folder in (
        "docs",
        "examples",
        "visualhfsm/_commands/template",
        "visualhfsm/_commands/template_hardware",
    ):
        paths += (ROOT / folder).rglob("*.py")
    return frozenset(name for path in paths for name in NAMED_ON_PAGES.findall(path.read_text("utf-8")))


@cache
def entrances() -> frozenset[str]:
    """Return the modules that the project declares as entry points, which are found without an import."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    declared = (each for group in project["entry-points"].values() for each in group.values())
    return frozenset(each.partition(":")[0] for each in declared)


def package_of(module: str) -> str:
    return module.partition(".")[0]


def is_private(module: str) -> bool:
    return any(part.startswith("_") for part in module.split("."))


def importers(module: str) -> Iterator[str]:
    """Yield the modules of other packages that import a module."""
    for importer in graph().find_modules_that_directly_import(module):
        if package_of(importer) != package_of(module):
            yield importer


def is_used_elsewhere(module: str) -> bool:
    """Return whether others use a module, or something below it, or run it as a command or an entrance."""
    return (
        module in named_on_pages()
        or module in entrances()
        or module.rpartition(".")[2].startswith("test_")  # pytest collects it
        or f"{module}.__main__" in graph().modules
        or any(importers(module))
        or any(is_used_elsewhere(each) for each in graph().find_children(module) if not is_private(each))
    )


@pytest.mark.slow
def test_what_no_other_package_uses_begins_with_an_underscore() -> None:
    public = (module for module in graph().modules if not is_private(module) and "." in module)
    left = [
        module
        for module in public
        if package_of(module) not in {GENERATED, "behaviors"} and not is_used_elsewhere(module)
    ]
    assert sorted(left) == []


def test_what_begins_with_an_underscore_is_used_by_its_own_package_alone() -> None:
    private = (module for module in graph().modules if is_private(module))
    found = [(importer, module) for module in private for importer in importers(module)]
    assert sorted(found) == []
