"""Each folder of plugins/ is a house of its own, and stands on the public names of the core alone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tools.lint.sources import PROJECT, ROOT, TESTS, imports
from tools.workspace import CORE, PLUG_INS, Distribution

ROOMS: Final = ("README.md", "docs", "src", "tests")
LONGEST: Final = 20
"""So many lines has its README at most."""


def mistakes() -> Iterator[str]:
    """Yield what a house lacks, who knows another, and which test of the core looks into one."""
    for house in PLUG_INS:
        name = house.folder.relative_to(ROOT)
        for mistake in (*_unlike_others(house), *_imports_of_another(house)):
            yield f"{name}: {mistake}"
    for path in TESTS.rglob("*.py"):
        text = path.read_text("utf-8")
        if "doors" not in path.parts:
            for house in PLUG_INS:
                if f"plugins.{house.folder.name}.tests" in text:
                    yield f"{path.relative_to(ROOT)}: it uses what belongs to plugins/{house.folder.name}"


def _unlike_others(house: Distribution) -> Iterator[str]:
    yield from (f"it has no {room}" for room in ROOMS if not (house.folder / room).exists())
    version = CORE.project["version"]
    if house.project["version"] != version:
        yield f"its version is not {version}"
    if house.project["name"] != f"visualhfsm-{house.folder.name.replace('_', '-')}":
        yield "its distribution has another name than its folder"
    for requirement in house.project["dependencies"]:
        if requirement.startswith("visualhfsm") and not requirement.endswith(f"=={version}"):
            yield f"{requirement}: it stands on the core of its own version, {version}"
    source = f"{house.folder.relative_to(ROOT)}/src"
    if source not in PROJECT["tool"]["pytest"]["ini_options"]["pythonpath"]:
        yield f"pyproject.toml: pytest: pythonpath lacks {source}"
    if not any(path.endswith(f"/{source}") for path in PROJECT["tool"]["mypy"]["mypy_path"]):
        yield f"pyproject.toml: mypy: mypy_path lacks {source}"


def _imports_of_another(house: Distribution) -> Iterator[str]:
    own = {path.name for path in house.packages}
    others = {path.name for each in PLUG_INS for path in each.packages} - own
    for module in imports().modules:
        if module.partition(".")[0] in own:
            for imported in imports().find_modules_directly_imported_by(module):
                if imported.partition(".")[0] in others:
                    yield f"{module} imports {imported}, which is another plug-in's"
