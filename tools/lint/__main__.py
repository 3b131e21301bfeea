"""Check the repository itself: `python -m tools.lint` prints each mistake in a line, and then ends with 1.

Each module here has a function `mistakes`, and says in its first line what holds. Names of modules select
some of them, as in `python -m tools.lint words pages`.
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Final

from tools.workspace import WHOLE

NO_CHECKS: Final = frozenset({"__main__", "sources"})
OF_THE_WHOLE: Final = frozenset({"body_names", "layout", "notices", "privacy"})
"""Checks that say what is used nowhere, or is gone: they need every plug-in."""


def main(names: list[str]) -> int:
    """Run the checks, or those that are named, and return the exit code."""
    left_out = NO_CHECKS if WHOLE else NO_CHECKS | OF_THE_WHOLE
    there = sorted(path.stem for path in Path(__file__).parent.glob("*.py") if path.stem not in left_out)
    found = [each for name in names or there for each in import_module(f"tools.lint.{name}").mistakes()]
    for mistake in found:
        print(mistake)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
