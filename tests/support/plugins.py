"""Plug-ins for a test: those of somebody else installed, and ours taken away."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import pytest

from tools.workspace import WHOLE
from zenoh_ice import plugins

__all__ = [
    "OF_THE_WHOLE",
    "OLD_DOCUMENTS",
    "OWN_ROBOTS",
    "installed",
    "needs",
    "without",
    "write_distribution",
]


def needs(plug_in: str) -> pytest.MarkDecorator:
    """Return a mark of tests of the core that need a plug-in, and are skipped in a tree without it."""
    return pytest.mark.skipif(find_spec(plug_in) is None, reason=f"needs the plug-in {plug_in}")


OF_THE_WHOLE: Final = pytest.mark.skipif(not WHOLE, reason="compares pages with all plug-ins")
"""Marks tests of what the whole repository has, which a checkout without some plug-in lacks."""
OLD_DOCUMENTS: Final = needs("visualhfsm_old_documents")
"""Marks tests of documents that may be those of other editors."""
OWN_ROBOTS: Final = needs("visualhfsm_own_robots")
"""Marks tests of robots that are made of a model."""


def write_distribution(folder: Path, name: str, points: Mapping[str, Mapping[str, str]]) -> None:
    """Write what says that a distribution is installed in a folder, with entry points by group."""
    about = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [
        line
        for group, named in points.items()
        for line in (f"[{group}]", *(f"{point} = {value}" for point, value in named.items()))
    ]
    (about / "entry_points.txt").write_text("\n".join(lines) + "\n")


@contextmanager
def installed(folder: Path, points: Mapping[str, Mapping[str, str]], **modules: str) -> Iterator[None]:
    """Let a distribution `a-stranger` be installed in a folder, with entry points by group.

    It has `modules` by their dotted names.
    """
    for name, code in modules.items():
        file = folder.joinpath(*name.split(".")).with_suffix(".py")
        file.parent.mkdir(exist_ok=True)
        file.write_text(code)
    write_distribution(folder, "a-stranger", points)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        _forget()
        try:
            yield
        finally:
            for name in modules:
                sys.modules.pop(name, None)
                sys.modules.pop(name.partition(".")[0], None)
            _forget()


@contextmanager
def without(*packages: str) -> Iterator[None]:
    """Let some packages not be found in a `with` block, and nothing that they add to a seam."""
    own = {name for name in sys.modules if name.partition(".")[0] in packages}
    with pytest.MonkeyPatch.context() as patch:
        for name in own.union(packages):
            patch.setitem(sys.modules, name, None)
        _forget()
        try:
            yield
        finally:
            patch.undo()
            _forget()


def _forget() -> None:
    plugins.names.cache_clear()
    plugins.find.cache_clear()
