"""Modules import one another in one direction, those of the page too; circles are small and of one idea."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping
from typing import Final

import grimp

from tools.lint.sources import imports
from visualhfsm._base.html_file import STATIC

LARGEST_CIRCLE: Final = 3
"""Modules, such as those of a project, its documents and what is known of them, which name one another."""

PAGE_COMMENT: Final = re.compile(r"/\*.*?\*/|^\s*//.*?$", re.DOTALL | re.MULTILINE)
PAGE_IMPORT: Final = re.compile(
    r"""^\s*(?:import|export)\s(?:[^"';]*?\sfrom\s)?\s*["'](\.[^"']+)["']
      | \bimport\(\s*["'](\.[^"']+)["']""",
    re.MULTILINE | re.VERBOSE,
)
"""An import of a module of the page, at its beginning or when it is first needed."""


PAGE_FLOORS: Final = (
    *("kit", "measures", "data", "code", "canvas", "run", "robot3d"),
    *("dialogs panels shelf", "shell", "onefile"),
)
"""The folders of the page from below. What is imported when needed, such as a dialog, may stand above."""


def _circles(graph: grimp.ImportGraph) -> list[list[str]]:
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


def _page_graph(modules: Mapping[str, str], *, on_need: bool = True) -> grimp.ImportGraph:
    """Return who imports whom in modules of the page, whose texts are given by their paths.

    Without `on_need` only the imports at their beginning count.
    """
    graph = grimp.ImportGraph()
    for name, text in modules.items():
        graph.add_module(name)
        for first, later in PAGE_IMPORT.findall(PAGE_COMMENT.sub("", text)):
            if target := first or (on_need and later):
                target = posixpath.normpath(posixpath.join(posixpath.dirname(name), target))
                graph.add_import(importer=name, imported=target)
    return graph


def _page_modules() -> dict[str, str]:
    """Return the texts of the modules of the page, by their paths."""
    paths = [path for path in STATIC.rglob("*.js") if "vendor" not in path.parts]
    return {path.relative_to(STATIC).as_posix(): path.read_text("utf-8") for path in paths}


def mistakes() -> Iterator[str]:
    """Yield the circles that are too large, and what imports a floor of the page above its own."""
    page = _page_graph(_page_modules())
    if page.count_imports() <= 400:
        yield "the imports of the page's modules are not found any more"
    for graph in (imports(), page):
        for circle in _circles(graph):
            if len(circle) > LARGEST_CIRCLE:
                yield f"{' and '.join(circle)} import one another: at most {LARGEST_CIRCLE} may"
    yield from _upwards(_page_graph(_page_modules(), on_need=False))


def _upwards(graph: grimp.ImportGraph) -> Iterator[str]:
    floor = {folder: number for number, folders in enumerate(PAGE_FLOORS) for folder in folders.split()}
    for importer in sorted(graph.modules):
        for imported in sorted(graph.find_modules_directly_imported_by(importer)):
            above, below = importer.split("/")[0], imported.split("/")[0]
            if above != below and floor[above] <= floor[below]:
                yield f"{importer} imports {imported}: the floors are, from below: {', '.join(PAGE_FLOORS)}"
