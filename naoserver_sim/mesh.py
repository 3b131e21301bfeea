"""Meshes of rounded shells, made by sweeping superellipses along an axis, and of panels and bands on them."""

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
    """A surface of triangles, counter-clockwise from outside."""

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


def panel(
    sections: Sequence[Section],
    *,
    at: tuple[float, float],
    angle: tuple[float, float],
    axis: str = "z",
    taper: float = 0.0,
    lift: float = 0.0008,
    roundness: float = 4.0,
    grid: tuple[int, int] = (9, 9),
) -> Mesh:
    """Cover a part of a loft's side with a plate, `lift` m above it and open towards it.

    It reaches between two places along the axis and between two angles in degrees about it, from the first of
    the other axes to the second: on a loft along z 0 is ahead and 90 to the left, on one along x 0 is to the
    left and 90 above. By the share `taper` it is wider at its second place, and narrower at the first.
    Its outline is a superellipse: the higher the `roundness`, the squarer.
    """
    rings = _interpolate(np.array([[s.at, *s.half, *s.center, s.squareness] for s in sections]))
    s, t = np.meshgrid(np.linspace(-1, 1, grid[0]), np.linspace(-1, 1, grid[1]), indexing="ij")
    reach = np.maximum(np.maximum(np.abs(s), np.abs(t)), 1e-9)
    rounded = reach / (np.abs(s) ** roundness + np.abs(t) ** roundness + 1e-30) ** (1 / roundness)
    s, t = s * rounded, t * rounded
    place = (at[0] + at[1]) / 2 + s * (at[1] - at[0]) / 2
    turn = np.radians((angle[0] + angle[1]) / 2 + t * (1 + taper * s) * (angle[1] - angle[0]) / 2)
    points = _on_side(rings, place, turn)
    outward = np.cross(
        _on_side(rings, place, turn + 1e-4) - points, _on_side(rings, place + 1e-5, turn) - points
    )
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    top = points + lift * outward
    number = np.arange(s.size).reshape(s.shape)
    rim = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])
    below = (points - lift * outward).reshape(-1, 3)[rim]
    corners = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    a, b, c, d = (corner.ravel() for corner in corners)
    low = s.size + np.arange(len(rim))
    after, low_after = np.roll(rim, -1), np.roll(low, -1)
    faces = [(a, b, c), (a, c, d), (rim, low, low_after), (rim, low_after, after)]
    vertices = np.concatenate([top.reshape(-1, 3), below])
    placed = np.empty_like(vertices)
    placed[:, list(_AXES[axis])] = vertices
    return Mesh(placed, np.concatenate([np.column_stack(face) for face in faces]).astype(np.int32))


def band(
    sections: Sequence[Section],
    *,
    at: tuple[float, float],
    axis: str = "z",
    lift: float = 0.0005,
    slices: int = 20,
) -> Mesh:
    """Lay a band round a loft between two places along its axis, `lift` m above it."""
    rings = _interpolate(np.array([[s.at, *s.half, *s.center, s.squareness] for s in sections]))
    around = []
    for place in at:
        _, half_u, half_v, u, v, squareness = _ring_at(rings, np.array(place))
        around.append(
            Section(
                place, (float(half_u) + lift, float(half_v) + lift), (float(u), float(v)), float(squareness)
            )
        )
    return loft(around, axis=axis, slices=slices)


def _ring_at(rings: NDArray[np.float64], place: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return the columns of the rings at places along the axis."""
    return [np.interp(place, rings[:, 0], column) for column in rings.T]


def _on_side(
    rings: NDArray[np.float64], place: NDArray[np.float64], turn: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return points (u, v, w) on the side of a loft."""
    _, half_u, half_v, center_u, center_v, squareness = _ring_at(rings, place)
    cosine, sine = np.cos(turn), np.sin(turn)
    u = center_u + half_u * np.sign(cosine) * np.abs(cosine) ** (2 / squareness)
    v = center_v + half_v * np.sign(sine) * np.abs(sine) ** (2 / squareness)
    return np.stack([u, v, place], axis=-1)


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
