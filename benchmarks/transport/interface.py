"""Generate the classes of robot.ice: ours with codegen, Ice's with its own compiler."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

SLICE: Final = Path(__file__).with_name("robot.ice")
REPOSITORY: Final = SLICE.parents[2]
REALM: Final = "bench"
IDENTITY: Final = "Robot"
"""The identity of the servant, unless there are two."""

_PACKAGE: Final = "bench_generated"


def generate(folder: Path) -> None:
    """Generate our package in a folder, once for all processes."""
    source = folder / "robot.idl"
    shutil.copy(SLICE, source)
    command = [sys.executable, "-m", "codegen", str(source), "-o", str(folder / _PACKAGE)]
    subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True, timeout=60)


def load_generated(folder: Path) -> Any:  # noqa: ANN401
    """Import our generated classes from a folder."""
    sys.path.insert(0, str(folder))
    return importlib.import_module(f"{_PACKAGE}.Bench")


def load_ice() -> tuple[Any, Any]:
    """Import Ice's classes and Ice."""
    ice = importlib.import_module("Ice")
    ice.loadSlice(f"--all -I{SLICE.parent} {SLICE}")
    return importlib.import_module("Bench"), ice
