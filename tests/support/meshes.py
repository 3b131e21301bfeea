"""Meshes of a model that a test writes itself."""

from __future__ import annotations

import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike


def write_stl(path: Path, triangles: ArrayLike) -> None:
    """Write triangles, of shape (n, 3, 3), as a binary STL; their normals are left to the reader."""
    corners = np.asarray(triangles, np.float32)
    records = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("color", "<u2")])
    records["corners"] = corners
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(bytes(80) + struct.pack("<I", len(corners)) + records.tobytes())


def cone(radius: float, height: float, *, sides: int, rings: int = 1) -> np.ndarray:
    """Return the triangles of a cone on the plane z = 0 in m: `sides` * 2 * `rings`."""
    around = np.linspace(0.0, 2 * np.pi, sides + 1)
    circle = np.stack([np.cos(around), np.sin(around)], axis=1)
    shares = np.linspace(1.0, 0.0, rings + 1)
    levels = [
        np.column_stack([share * radius * circle, np.full(sides + 1, (1 - share) * height)])
        for share in shares
    ]
    found = []
    for lower, upper in pairwise(levels):
        found.append(np.stack([lower[:-1], lower[1:], upper[1:]], axis=1))
        found.append(np.stack([lower[:-1], upper[1:], upper[:-1]], axis=1))
    floor = np.zeros((sides, 3))
    found[-1] = np.stack([floor, levels[0][1:], levels[0][:-1]], axis=1)  # the tip needs no second triangle
    return np.concatenate(found)
