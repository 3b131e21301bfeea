"""Stacks of processes as their users start them."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.support.processes import ComponentProcess


def stack_in(folder: Path, name: str, *options: str, **environment: str) -> ComponentProcess:
    """Start a stack by its name in a folder."""
    program = f"import os; os.chdir({str(folder)!r}); from nao_tools.__main__ import main; main()"
    return ComponentProcess([sys.executable, "-c", program, "stack", name, *options], environment)
