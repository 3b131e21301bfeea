"""Make the meshes of a robot's looks from its lofts: `python tools/lofts/loft.py LOFTS.toml MESHES.obj`.

A loft sweeps a surface smoothly through superellipses that stand across an axis. A panel is a plate on a part
of a loft's side, a band goes round it. `booster_t1.toml` beside this file explains the keys. Lengths in m,
angles in degrees.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, Literal, NamedTuple

import msgspec
import numpy as np
import typer
from msgspec import Struct
from numpy.typing import NDArray

_NEARLY: Final = 0.97
"""Share of a dome's quarter turn at its last ring: the rest is closed by triangles to its middle."""
_AXES: Final = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}
"""Columns of the axes (u, v, w) of a loft, right-handed; w is the one along which it is swept."""

Points = NDArray[np.float64]
Faces = NDArray[np.intp]


class Section(Struct, frozen=True, forbid_unknown_fields=True):
    """A superellipse across the axis of a loft."""

    at: float
    """Place along the axis."""
    half: tuple[float, float]
    """Half widths along the two other axes in cyclic order, such as y and z of a loft along x."""
    center: tuple[float, float] = (0.0, 0.0)
    squareness: float = 2.4
    """2 is an ellipse; more comes nearer to a rectangle with rounded corners."""


class Loft(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="loft"):
    """A surface through sections."""

    sections: tuple[Section, ...]
    axis: Literal["x", "y", "z"] = "z"
    domes: tuple[float, float] = (0.0, 0.0)
    """Heights by which the two ends bulge; an end that does not has a sharp edge."""
    slices: int = 20
    """Corners of a ring."""
    rings: int = 2
    """Rings from one section to the next."""
    dome_rings: int = 4
    open: bool = False
    """Whether ends without a dome are open: a camera behind the surface looks through it."""


class Panel(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="panel"):
    """A plate above a part of a loft's side, open towards it; its outline is a superellipse."""

    on: str
    at: tuple[float, float]
    """Places along the axis between which it reaches."""
    angle: tuple[float, float]
    """Angles about the axis between which it reaches, from the first of the other axes to the second."""
    taper: float = 0.0
    """Share by which it is wider at its second place, and narrower at the first."""
    lift: float = 0.001
    """Distance from the loft."""
    roundness: float = 4.0
    """The higher, the squarer is its outline."""
    grid: tuple[int, int] = (9, 9)
    """Points along the axis and about it."""


class Band(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="band"):
    """A band round a loft between two places along its axis."""

    on: str
    at: tuple[float, float]
    lift: float = 0.0006
    slices: int = 20


class Mesh(NamedTuple):
    """A surface of quadrangles and triangles: numbers of vertices, counter-clockwise from outside."""

    vertices: Points
    quads: Faces
    triangles: Faces


def make_meshes(parts: Mapping[str, Loft | Panel | Band]) -> dict[str, Mesh]:
    """Return the meshes of lofts, and of the panels and bands on them."""
    lofts = {name: part for name, part in parts.items() if isinstance(part, Loft)}
    meshes = {}
    for name, part in parts.items():
        if isinstance(part, Loft):
            meshes[name] = _loft(part)
        elif isinstance(part, Panel):
            meshes[name] = _panel(part, lofts[part.on])
        else:
            meshes[name] = _band(part, lofts[part.on])
    return meshes


def write_obj(meshes: Mapping[str, Mesh]) -> str:
    """Return meshes in Wavefront's format."""
    lines = ["# The meshes of looks.toml, made by tools/lofts: faces counter-clockwise from outside, in m."]
    before = 1
    for name, (vertices, quads, triangles) in meshes.items():
        lines.append(f"o {name}")
        lines += ["v " + " ".join(f"{value + 0.0:.4f}" for value in vertex) for vertex in vertices.round(4)]
        lines += ["f " + " ".join(str(before + corner) for corner in face) for face in (*quads, *triangles)]
        before += len(vertices)
    return "\n".join(lines) + "\n"


def _loft(loft: Loft) -> Mesh:
    rings, slices = _with_domes(loft), loft.slices
    angle = np.linspace(0.0, 2.0 * math.pi, slices, endpoint=False)
    swept = [_around(ring, angle) for ring in rings]
    here = np.arange(slices)
    after = (here + 1) % slices
    quads = [
        np.column_stack([low + here, low + after, low + slices + after, low + slices + here])
        for low in range(0, (len(rings) - 1) * slices, slices)
    ]
    vertices, triangles = np.concatenate(swept), []
    for edge, dome, forward in ((0, loft.domes[0], False), (len(rings) - 1, loft.domes[1], True)):
        if loft.open and not dome:
            continue
        rim = edge * slices + here
        if not dome:
            # The edge of a flat end is there twice: neither of the surfaces that meet there looks rounded.
            rim = len(vertices) + here
            vertices = np.concatenate([vertices, swept[edge]])
        middle = np.full(slices, len(vertices))
        vertices = np.concatenate([vertices, rings[edge : edge + 1, [3, 4, 0]]])
        around = (rim, rim[after]) if forward else (rim[after], rim)
        triangles.append(np.column_stack([middle, *around]))
    return _placed(vertices, quads, triangles, loft.axis)


def _panel(panel: Panel, loft: Loft) -> Mesh:
    rings = _interpolate(loft)
    rows, columns = panel.grid
    s, t = np.meshgrid(np.linspace(-1, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
    reach = np.maximum(np.maximum(np.abs(s), np.abs(t)), 1e-9)
    power = panel.roundness
    rounded = reach / (np.abs(s) ** power + np.abs(t) ** power + 1e-30) ** (1 / power)
    s, t = s * rounded, t * rounded
    place = (panel.at[0] + panel.at[1]) / 2 + s * (panel.at[1] - panel.at[0]) / 2
    middle, half = (panel.angle[0] + panel.angle[1]) / 2, (panel.angle[1] - panel.angle[0]) / 2
    turn = np.radians(middle + t * (1 + panel.taper * s) * half)
    points = _on_side(rings, place, turn)
    about = _on_side(rings, place, turn + 1e-4) - points
    along = _on_side(rings, place + 1e-5, turn) - points
    outward = np.cross(about, along)
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    number = np.arange(s.size).reshape(s.shape)
    rim = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])
    top = (points + panel.lift * outward).reshape(-1, 3)
    below = (points - panel.lift * outward).reshape(-1, 3)[rim]
    low = s.size + np.arange(len(rim))
    corners = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    plate = np.column_stack([corner.ravel() for corner in corners])
    edge = np.column_stack([rim, low, np.roll(low, -1), np.roll(rim, -1)])
    return _placed(np.concatenate([top, below]), [plate, edge], [], loft.axis)


def _band(band: Band, loft: Loft) -> Mesh:
    rings = _interpolate(loft)
    sections = []
    for place in band.at:
        _, half_u, half_v, u, v, squareness = (
            float(np.interp(place, rings[:, 0], column)) for column in rings.T
        )
        half = half_u + band.lift, half_v + band.lift
        sections.append(Section(place, half, (u, v), squareness))
    return _loft(Loft(tuple(sections), loft.axis, slices=band.slices, rings=1))


def _placed(swept: Points, quads: Sequence[Faces], triangles: Sequence[Faces], axis: str) -> Mesh:
    vertices = np.empty_like(swept)
    vertices[:, list(_AXES[axis])] = swept
    return Mesh(vertices, np.concatenate(quads), np.concatenate([np.empty((0, 3), np.intp), *triangles]))


def _around(ring: Points, angle: Points) -> Points:
    """Return points (u, v, w) at angles about the axis on a ring, or on one ring for each angle."""
    at, half_u, half_v, center_u, center_v, squareness = ring
    cosine, sine = np.cos(angle), np.sin(angle)
    power = 2.0 / squareness
    u = center_u + half_u * np.sign(cosine) * np.abs(cosine) ** power
    v = center_v + half_v * np.sign(sine) * np.abs(sine) ** power
    return np.stack([u, v, at + 0.0 * angle], axis=-1)


def _on_side(rings: Points, place: Points, turn: Points) -> Points:
    _, *columns = rings.T
    ring = [place, *(np.interp(place, rings[:, 0], column) for column in columns)]
    return _around(np.array(ring), turn)


def _interpolate(loft: Loft) -> Points:
    """Return the rings through the sections of a loft, on a Catmull-Rom spline."""
    keys = np.array([[s.at, *s.half, *s.center, s.squareness] for s in loft.sections])
    padded = np.concatenate([2 * keys[:1] - keys[1:2], keys, 2 * keys[-1:] - keys[-2:-1]])
    rings = []
    for number in range(1, len(keys)):
        before, start, end, after = padded[number - 1 : number + 3]
        t = np.arange(loft.rings)[:, None] / loft.rings
        linear = t * (end - before)
        square = t**2 * (2 * before - 5 * start + 4 * end - after)
        cube = t**3 * (3 * start - before - 3 * end + after)
        rings.append(start + 0.5 * (linear + square + cube))
    return np.concatenate([*rings, keys[-1:]])


def _with_domes(loft: Loft) -> Points:
    """Return the rings of a loft with an elliptic dome on each end that has one."""
    rings, domes = _interpolate(loft), loft.domes
    angles = np.linspace(0, math.pi / 2, loft.dome_rings + 1)[1:]
    angles[-1] *= _NEARLY
    first = [_shrunk(rings[0], -domes[0], angle) for angle in reversed(angles)] if domes[0] else []
    last = [_shrunk(rings[-1], domes[1], angle) for angle in angles] if domes[1] else []
    return np.array([*first, *rings, *last])


def _shrunk(ring: Points, height: float, angle: float) -> Points:
    shrunk = ring.copy()
    shrunk[0] += height * math.sin(angle)
    shrunk[1:3] *= math.cos(angle)
    return shrunk


def main(lofts: Path, meshes: Path) -> None:
    """Write the meshes of a file of lofts."""
    parts = msgspec.toml.decode(lofts.read_text(encoding="utf-8"), type=dict[str, Loft | Panel | Band])
    meshes.write_text(write_obj(make_meshes(parts)), encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
