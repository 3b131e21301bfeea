"""What only its own package uses begins with an underscore, and no other package uses that."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Final

from tools.lint.sources import ROOT, imports
from tools.workspace import DISTRIBUTIONS

GENERATED: Final = "interfaces"
NAMED_ON_PAGES: Final = re.compile(
    r"""(?:from\ |import\ |:::\ |python\ -m\ |--pyargs\ |gymnasium\.make\w*\(")
        ([a-z_0-9]+(?:\.[a-z_0-9]+)*)""",
    re.VERBOSE,
)
"""A module that pages and examples name: as an import, as a command, as tests, as environments,
or in the reference of the API."""


@cache
def _named_on_pages() -> frozenset[str]:
    paths = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *ROOT.glob("plugins/*/docs/*.md")]
    for folder in (
        "docs",
        "examples",
        "visualhfsm/_commands/template",
        "visualhfsm/_commands/template_hardware",
    ):
        paths += (ROOT / folder).rglob("*.py")
    return frozenset(name for path in paths for name in NAMED_ON_PAGES.findall(path.read_text("utf-8")))


@cache
def _entrances() -> frozenset[str]:
    """Return the modules that the project declares as entry points, which are found without an import.

    So are all modules of a package that is a kind of endpoints.
    """
    groups = [each.project.get("entry-points", {}) for each in DISTRIBUTIONS]
    declared = {
        found.partition(":")[0] for each in groups for group in each.values() for found in group.values()
    }
    kinds = [
        imports().find_children(package)
        for each in groups
        for package in each.get("visualhfsm.kinds", {}).values()
    ]
    return frozenset(declared.union(*kinds))


def _package_of(module: str) -> str:
    return module.partition(".")[0]


def _is_private(module: str) -> bool:
    return any(part.startswith("_") for part in module.split("."))


def _importers(module: str) -> Iterator[str]:
    """Yield the modules of other packages that import a module."""
    for importer in imports().find_modules_that_directly_import(module):
        if _package_of(importer) != _package_of(module):
            yield importer


def _is_used_elsewhere(module: str) -> bool:
    """Return whether others use a module, or something below it, or run it as a command or an entrance."""
    return (
        module in _named_on_pages()
        or module in _entrances()
        or module.rpartition(".")[2].startswith("test_")  # pytest collects it
        or f"{module}.__main__" in imports().modules
        or any(_importers(module))
        or any(_is_used_elsewhere(each) for each in imports().find_children(module) if not _is_private(each))
    )


def mistakes() -> Iterator[str]:
    """Yield what should begin with an underscore, and what does although others use it."""
    for module in sorted(imports().modules):
        if _is_private(module):
            for importer in _importers(module):
                yield f"{importer} imports {module}, which is another package's own"
        elif (
            "." in module
            and _package_of(module) not in {GENERATED, "behaviors"}
            and not _is_used_elsewhere(module)
        ):
            yield f"{module} is used by its own package alone: begin its name with an underscore"
