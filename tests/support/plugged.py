"""A distribution of somebody else, with entry points of our seams, where Python looks."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from zenoh_ice import plugins

__all__ = ["plugged"]


@contextmanager
def plugged(folder: Path, code: str, **points: str) -> Iterator[None]:
    """Install a module `stranger` with entry points, by seams whose dots are `__`: `nao_tools__checks="dust = check"`.

    `dust = check` stands for `dust = stranger:check`.
    """
    (folder / "stranger.py").write_text(code)
    about = folder / "a_stranger-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: a-stranger\nVersion: 1.0\n")
    groups = [
        f"[{seam.replace('__', '.')}]\n{point.replace(' = ', ' = stranger:')}"
        for seam, point in points.items()
    ]
    (about / "entry_points.txt").write_text("\n".join(groups) + "\n")
    sys.path.insert(0, str(folder))
    try:
        _forget()
        yield
    finally:
        sys.path.remove(str(folder))
        sys.modules.pop("stranger", None)
        _forget()


def _forget() -> None:
    importlib.invalidate_caches()
    plugins.names.cache_clear()
    plugins.find.cache_clear()
