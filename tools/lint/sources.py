"""What several checks read: the repository's folders, its configuration, and who imports whom."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any, Final

import grimp

__all__ = ["PROJECT", "ROOT", "TESTS", "imports"]

ROOT: Final = Path(__file__).resolve().parents[2]
TESTS: Final = ROOT / "tests"
PROJECT: Final[dict[str, Any]] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


@cache
def imports() -> grimp.ImportGraph:
    """Return who imports whom, in the packages of the wheel and in the behaviors."""
    return grimp.build_graph(*PROJECT["tool"]["importlinter"]["root_packages"], cache_dir=None)
