"""Packages that import their names when these are first used, so that importing the package takes no time."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable
from functools import cache
from typing import Any, Final

_IMPORT: Final = re.compile(r"^    from (\S+) import (\w+) as \2$", re.MULTILINE)


def import_on_use(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the `__getattr__` of a package (PEP 562) that imports its names, and the `__dir__` with them.

    The names are those that the package imports for type checkers, each in a separate line below
    `if TYPE_CHECKING`: `from .clock import Clock as Clock`.
    """

    @cache
    def modules() -> dict[str, str]:
        loader: Any = sys.modules[package].__loader__
        return {name: module for module, name in _IMPORT.findall(loader.get_source(package))}

    def load(name: str) -> Any:  # noqa: ANN401
        if name not in modules():
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(modules()[name], package), name)

    def complete() -> list[str]:
        return sorted({*vars(sys.modules[package]), *modules()})

    return load, complete
