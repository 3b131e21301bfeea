"""What several checks read: the repository's folders, its configuration, and who imports whom."""

from __future__ import annotations

from functools import cache
from typing import Final

import grimp

from tools.workspace import CORE, DISTRIBUTIONS, PLUG_INS, ROOT

__all__ = ["PROJECT", "ROOT", "TESTS", "TEST_FOLDERS", "imports"]

TESTS: Final = ROOT / "tests"
PROJECT: Final = CORE.settings
TEST_FOLDERS: Final = [TESTS, *(each.folder / "tests" for each in PLUG_INS)]


@cache
def imports() -> grimp.ImportGraph:
    """Return who imports whom, in the packages of all wheels and in the behaviors."""
    packages = [path.name for each in DISTRIBUTIONS for path in each.packages]
    return grimp.build_graph(*packages, "behaviors", cache_dir=None)
