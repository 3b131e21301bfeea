"""The environment of child processes."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from pathlib import Path


def child_environment(include: Iterable[Path] = ()) -> dict[str, str]:
    """Return the environment in which a child finds the packages that this process finds.

    `include` are directories with further packages, which come first.
    """
    path = [*map(str, include), *(entry for entry in sys.path if entry)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path)}
