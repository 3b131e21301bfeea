"""What the processor lacks for the libraries that we load: they end a process that it cannot run."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Final

__all__ = ["lacks_of_mujoco"]

_NEEDED: Final = "avx"
"""What MuJoCo's library for x86-64 asks for (its programming guide, "Introduction")."""
_FACTS: Final = Path("/proc/cpuinfo")
_ONE: Final = 1 << 13  # bytes with the facts of the first processor; computing those of all takes time


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
