"""Environments as the pages of docs/ ask people to make them: ours installed, and no library but those asked for.

Nothing is downloaded: the libraries are those of the tests' environment.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterable
from importlib.metadata import Distribution, distribution
from pathlib import Path
from typing import Final

from packaging.requirements import Requirement

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tools.workspace import DISTRIBUTIONS

__all__ = ["copy_packages", "make_environment"]

OURS: Final = "visualhfsm"
_THERE: Final = {each.project["name"] for each in DISTRIBUTIONS}
SCRIPT: Final = """#!/bin/sh
'''exec' "{python}" "$0" "$@"
' '''
import sys
from {module} import {function}
sys.exit({function}())
"""
"""A program as pip writes it where the path of Python has spaces: a shell reads the first lines, Python a text."""


def copy_packages(folder: Path, *, checkout: bool = False) -> None:
    """Copy what a wheel has into a folder, with the compiled modules; as a `checkout` has it, if asked."""
    for each in DISTRIBUTIONS:
        for package in each.packages:
            shutil.copytree(package, folder / (package.relative_to(ROOT) if checkout else package.name))
        for shipped, place in each.shipped.items():
            if shipped.is_dir():
                shutil.copytree(shipped, folder / (shipped.relative_to(ROOT) if checkout else place))


def make_environment(home: Path, extras: Iterable[str], *, packages: Path, editable: bool = False) -> Path:
    """Make what `pip install 'visualhfsm[EXTRAS]'` makes of an empty environment; return the folder of its programs.

    `packages` is a folder of `copy_packages`, from which they are installed, as a checkout is if it is `editable`.
    Raises `PackageNotFoundError` if a library is not there.
    """
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", home], check=True, timeout=RUN_LIMIT)
    (site,) = home.glob("lib/python*/site-packages")
    found = _required(OURS, frozenset(extras))
    for name, library in found.items():
        for top in {file.parts[0] for file in library.files or ()} - {".."}:
            if name.startswith(OURS) and not top.endswith(".dist-info"):
                continue  # the checkout of the tests
            if not (site / top).exists():  # several may share a folder
                (site / top).symlink_to(str(library.locate_file(top)))
        for entry in library.entry_points.select(group="console_scripts"):
            module, _, function = entry.value.partition(":")
            program = home / "bin" / entry.name
            program.write_text(
                SCRIPT.format(python=home / "bin" / "python", module=module, function=function)
            )
            program.chmod(0o755)
    ours = [package for each in DISTRIBUTIONS if each.project["name"] in found for package in each.packages]
    if editable:
        folders = {packages / package.relative_to(ROOT).parent: None for package in ours}
        (site / f"{OURS}.pth").write_text("".join(f"{folder}\n" for folder in folders))
    else:
        for package in ours:
            (site / package.name).symlink_to(packages / package.name)
    return home / "bin"


def _required(name: str, extras: frozenset[str]) -> dict[str, Distribution]:
    """Return a distribution and all that it requires with these extras, by name."""
    found: dict[str, Distribution] = {}
    seen: set[tuple[str, frozenset[str]]] = set()
    wanted = [(name, extras)]
    while wanted:
        name, extras = this = wanted.pop()
        if this in seen:
            continue
        seen.add(this)
        found[name] = distribution(name)
        for text in found[name].requires or ():
            requirement = Requirement(text)
            if requirement.name.startswith(f"{OURS}-") and requirement.name not in _THERE:
                continue  # a plug-in whose folder was deleted
            marker = requirement.marker
            if marker is None or any(marker.evaluate({"extra": extra}) for extra in {"", *extras}):
                wanted.append((requirement.name, frozenset(requirement.extras)))
    return found
