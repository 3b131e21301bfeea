"""Modules import one another in one direction, those of the page too; circles are small and of one idea."""

from __future__ import annotations

import posixpath
import re
import tomllib
from collections.abc import Mapping
from typing import Final

import grimp

from tests.support.places import ROOT
from visualhfsm._base.html_file import STATIC

LARGEST_CIRCLE: Final = 3
"""Modules, such as those of a project, its documents and what is known of them, which name one another."""

PAGE_COMMENT: Final = re.compile(r"/\*.*?\*/|^\s*//.*?$", re.DOTALL | re.MULTILINE)
PAGE_IMPORT: Final = re.compile(
    r"""^\s*(?:import|export)\s(?:[^"';]*?\sfrom\s)?\s*["'](\.[^"']+)["'] | \bimport\(\s*["'](\.[^"']+)["']""",
    re.MULTILINE | re.VERBOSE,
)
"""An import of a module of the page, at its beginning or when it is first needed."""


PAGE_FLOORS: Final = (
    *("kit", "measures", "data", "code", "canvas", "run", "robot3d"),
    *("dialogs panels shelf trials", "shell", "onefile"),
)
"""The folders of the page from below. What is imported when it is first needed, such as a dialog, may stand above."""


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


def page_graph(modules: Mapping[str, str], *, on_need: bool = True) -> grimp.ImportGraph:
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


def page_modules() -> dict[str, str]:
    """Return the texts of the modules of the page, by their paths."""
    paths = [path for path in STATIC.rglob("*.js") if "vendor" not in path.parts]
    return {path.relative_to(STATIC).as_posix(): path.read_text("utf-8") for path in paths}


def test_circles_of_imports_are_small() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    graph = grimp.build_graph(*project["tool"]["importlinter"]["root_packages"], cache_dir=None)
    assert [circle for circle in circles(graph) if len(circle) > LARGEST_CIRCLE] == []


def test_a_circle_through_several_modules_is_found() -> None:
    graph = grimp.ImportGraph()
    for importer, imported in (("a", "b"), ("b", "c"), ("c", "d"), ("d", "a"), ("e", "a")):
        graph.add_import(importer=importer, imported=imported)
    assert circles(graph) == [["a", "b", "c", "d"]]


def test_circles_of_the_page_are_small() -> None:
    graph = page_graph(page_modules())
    assert graph.count_imports() > 400
    assert [circle for circle in circles(graph) if len(circle) > LARGEST_CIRCLE] == []


def test_the_folders_of_the_page_stand_on_one_another() -> None:
    graph = page_graph(page_modules(), on_need=False)
    floor = {folder: number for number, folders in enumerate(PAGE_FLOORS) for folder in folders.split()}
    up = [
        f"{importer} imports {imported}"
        for importer in sorted(graph.modules)
        for imported in sorted(graph.find_modules_directly_imported_by(importer))
        if (above := importer.split("/")[0]) != (below := imported.split("/")[0])
        and floor[above] <= floor[below]
    ]
    assert up == [], f"the floors are, from below: {', '.join(PAGE_FLOORS)}"


def test_imports_of_the_page_are_found_where_they_are_needed_too() -> None:
    modules = {
        "app.js": 'import {\n  one,\n} from "./a/one.js";\nimport "./two.js";\n/** @import {X} from "./types.js" */',
        "a/one.js": 'const two = () => import("../two.js");\nexport {three} from "./three.js";',
        "a/three.js": '/**\n * import "./no.js";\n * @type {import("./no.js").X}\n */\n// import "./no.js";\n',
        "two.js": 'run(async () => (await import("./app.js")).start());\n',
    }
    graph = page_graph(modules)
    assert graph.modules == {*modules}
    assert graph.find_modules_directly_imported_by("a/one.js") == {"two.js", "a/three.js"}
    assert circles(graph) == [["a/one.js", "app.js", "two.js"]]
    first = page_graph(modules, on_need=False)
    assert first.find_modules_directly_imported_by("a/one.js") == {"a/three.js"}
