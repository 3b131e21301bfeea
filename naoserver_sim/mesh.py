"""Meshes of rounded shells, made by sweeping superellipses along an axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

_DOME_RINGS: Final = 4
_RINGS_A_SECTION: Final = 3

# Columns of the axes (u, v, w) of a loft, w being the one it is swept along, right-handed.
_AXES: Final = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}


@dataclass(frozen=True, slots=True)
class Section:
    """A superellipse across the axis of a loft. Lengths in m."""

    at: float
    """Place along the axis."""
    half: tuple[float, float]
    """Half widths along the two other axes in cyclic order, such as y and z of a loft along x."""
    center: tuple[float, float] = (0.0, 0.0)
    squareness: float = 2.0
    """2 is an ellipse; more comes nearer to a rectangle with rounded corners."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """A closed surface of triangles, counter-clockwise from outside."""

    vertices: NDArray[np.float64]
    """Shape (n, 3) in m."""
    faces: NDArray[np.int32]
    """Shape (m, 3), indices of vertices."""

    def mirrored(self) -> Mesh:
        """Return the mirror image with respect to the plane y = 0."""
        return Mesh(self.vertices * [1, -1, 1], self.faces[:, ::-1])


def loft(
    sections: Sequence[Section], *, axis: str = "z", domes: tuple[float, float] = (0.0, 0.0), slices: int = 20
) -> Mesh:
    """Sweep a surface smoothly through sections along `axis`.

    `domes` are the heights in m by which the two ends bulge, beyond the first and the last section.
    """
    keys = np.array([[s.at, *s.half, *s.center, s.squareness] for s in sections])
    rings = _with_domes(_interpolate(keys), domes)
    angle = np.linspace(0, 2 * math.pi, slices, endpoint=False)
    cosine, sine = np.cos(angle), np.sin(angle)
    points = []
    for at, half_u, half_v, center_u, center_v, squareness in rings:
        power = 2 / squareness
        u = center_u + half_u * np.sign(cosine) * np.abs(cosine) ** power
        v = center_v + half_v * np.sign(sine) * np.abs(sine) ** power
        points.append(np.column_stack([u, v, np.full(slices, at)]))
    # The two points that close the ends, in the planes of the outermost rings.
    ends = [np.array([[ring[3], ring[4], ring[0]]]) for ring in (rings[0], rings[-1])]
    swept = np.concatenate([*points, *ends])
    vertices = np.empty_like(swept)
    vertices[:, list(_AXES[axis])] = swept
    return Mesh(vertices, _faces(len(rings), slices))


def _interpolate(keys: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sections with more between them, on a Catmull-Rom spline."""
    padded = np.concatenate([2 * keys[:1] - keys[1:2], keys, 2 * keys[-1:] - keys[-2:-1]])
    rings = []
    for i in range(1, len(keys)):
        before, start, end, after = padded[i - 1 : i + 3]
        t = np.arange(_RINGS_A_SECTION)[:, None] / _RINGS_A_SECTION
        rings.append(
            start
            + 0.5 * t * (end - before)
            + 0.5 * t**2 * (2 * before - 5 * start + 4 * end - after)
            + 0.5 * t**3 * (3 * start - before - 3 * end + after)
        )
    return np.concatenate([*rings, keys[-1:]])


def _with_domes(rings: NDArray[np.float64], domes: tuple[float, float]) -> NDArray[np.float64]:
    """Return the rings with an elliptic dome on each end."""
    turns = np.linspace(0, math.pi / 2, _DOME_RINGS + 1)[1:]
    turns[-1] *= 0.97
    first = [_shrunk(rings[0], -domes[0], turn) for turn in reversed(turns)] if domes[0] else []
    last = [_shrunk(rings[-1], domes[1], turn) for turn in turns] if domes[1] else []
    return np.array([*first, *rings, *last])


def _shrunk(ring: NDArray[np.float64], height: float, turn: float) -> NDArray[np.float64]:
    shrunk = ring.copy()
    shrunk[0] += height * math.sin(turn)
    shrunk[1:3] *= math.cos(turn)
    return shrunk


def _faces(rings: int, slices: int) -> NDArray[np.int32]:
    here = np.arange(slices)
    after = (here + 1) % slices
    first, last = rings * slices, rings * slices + 1
    faces = [np.column_stack([np.full(slices, first), after, here])]
    for ring in range(rings - 1):
        low, high = ring * slices, (ring + 1) * slices
        faces.append(np.column_stack([low + here, low + after, high + after]))
        faces.append(np.column_stack([low + here, high + after, high + here]))
    top = (rings - 1) * slices
    faces.append(np.column_stack([np.full(slices, last), top + here, top + after]))
    return np.concatenate(faces).astype(np.int32)
