"""Packages that import their names when these are first used, so that importing the package takes no time."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any


def import_on_use(
    package: str, names: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the `__getattr__` of a package (PEP 562) that imports its names, and the `__dir__` with them.

    `names` has those of each module, separated by blanks: of `.clock` in the package, of `interfaces.motion`
    anywhere.
    """
    modules = {name: module for module, found in names.items() for name in found.split()}

    def load(name: str) -> Any:  # noqa: ANN401
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(modules[name], package), name)

    def complete() -> list[str]:
        return sorted({*vars(sys.modules[package]), *modules})

    return load, complete
