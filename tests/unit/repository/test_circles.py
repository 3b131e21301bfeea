"""Modules import one another in one direction; circles are small and of one idea."""

from __future__ import annotations

import tomllib
from typing import Final

import grimp

from tests.support.places import ROOT

LARGEST_CIRCLE: Final = 3
"""Modules, such as those of the communicator, its proxies and its servants, which name one another."""


def circles(graph: grimp.ImportGraph) -> list[list[str]]:
    """Return the groups of modules each of which imports all others, directly or not, if only for types."""
    found: list[list[str]] = []
    seen: set[str] = set()
    for module in sorted(graph.modules):
        if module not in seen:
            both = graph.find_upstream_modules(module) & graph.find_downstream_modules(module)
            circle = sorted({module, *both})
            seen.update(circle)
            found.append(circle)
    return [circle for circle in found if len(circle) > 1]


def test_circles_of_imports_are_small() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    graph = grimp.build_graph(*project["tool"]["importlinter"]["root_packages"], cache_dir=None)
    assert [circle for circle in circles(graph) if len(circle) > LARGEST_CIRCLE] == []


def test_a_circle_through_several_modules_is_found() -> None:
    graph = grimp.ImportGraph()
    for importer, imported in (("a", "b"), ("b", "c"), ("c", "d"), ("d", "a"), ("e", "a")):
        graph.add_import(importer=importer, imported=imported)
    assert circles(graph) == [["a", "b", "c", "d"]]
