"""The versions of what computes the outcome of a trial."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Final

_PACKAGES: Final = ("visualhfsm", "mujoco", "numpy")
"""What computes the outcome of a trial, besides Python."""


def versions() -> dict[str, str]:
    """Return the versions of what computes the outcome of a trial, in this process."""
    return {"python": platform.python_version(), **{name: _version(name) for name in _PACKAGES}}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "is missing"
