"""Reasons why MuJoCo does not run on a computer: its processor, or a part of the package."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Final

IN_PART: Final = (
    "MuJoCo is installed in part",
    "pip install --force-reinstall --no-deps mujoco mujoco-core mujoco-studio",
)
"""The state after pip installed MuJoCo 4 over an older one, and the remedy (its release notes of 4.0.0)."""

_NEEDED: Final = "avx"
"""The needs of MuJoCo's library for x86-64 (its programming guide, "Introduction")."""
_FACTS: Final = Path("/proc/cpuinfo")
_ONE: Final = 1 << 13  # bytes with the facts of the first processor; computing those of all takes time


def is_in_part(error: str) -> bool:
    """Return whether an import failed because MuJoCo is installed in part."""
    return "mujoco-core" in error


def lacks_of_mujoco() -> str:
    """Return what this processor lacks for MuJoCo, as a sentence; nothing where it is not known to."""
    if platform.machine() != "x86_64":
        return ""
    try:
        with _FACTS.open("rb") as file:
            text = file.read(_ONE)
    except OSError:
        return ""
    _, found, rest = text.partition(b"\nflags")
    if not found or _NEEDED.encode() in rest.partition(b"\n")[0].split():
        return ""
    return f"this processor lacks {_NEEDED.upper()}, which MuJoCo needs"
