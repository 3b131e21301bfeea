"""Find the library that would define a name: a usual module, a name of `math`, or a type of an interface."""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from typing import Final

from ..analysis import Analysis, Piece
from ..code.text import all_nodes
from ..known_interfaces import KnownInterfaces

_MODULES: Final = frozenset(
    {
        *("bisect", "cmath", "collections", "copy", "csv", "cv2", "datetime", "enum", "functools", "heapq"),
        *("itertools", "json", "logging", "math", "numpy", "os", "pathlib", "queue", "random", "re"),
        *("statistics", "string", "struct", "sys", "threading", "time"),
    }
)
"""Modules that behaviors use; others have names that code may as well have for something else."""
_ALIASES: Final = {"cv": "cv2 as cv", "np": "numpy as np"}
_MATH: Final = frozenset(name for name in dir(math) if len(name) > 1 and not name.startswith("_"))


@dataclass(frozen=True)
class KnownLibraries:
    """The libraries that a document may declare for the names that its code lacks."""

    analysis: Analysis
    interfaces: KnownInterfaces

    def defining(self, name: str, piece: Piece) -> str:
        """Return the library that defines a name as a piece of code uses it, blank if none surely does."""
        if name in _MODULES or name in _ALIASES:
            return _ALIASES.get(name, name) if _has_attributes(name, piece) else ""
        if name in _MATH:
            return f"from math import {name}"
        packages = self.interfaces.packages_of(name)
        if len(packages) > 1:
            declared = [self.interfaces.find(each.type) for each in self.analysis.document.interfaces]
            packages &= {found[0].package for found in declared if len(found) == 1}
        return f"from {packages.pop()} import {name}" if len(packages) == 1 else ""


def _has_attributes(name: str, piece: Piece) -> bool:
    """Return whether code uses attributes of a name: a module is nothing without them."""
    return any(
        isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == name
        for node in all_nodes(piece.tree)
    )
