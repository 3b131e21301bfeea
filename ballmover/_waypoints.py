"""Files of waypoints: CSV or TOML.

CSV: one waypoint a line, `x, y, z[, speed[, dwell]]`, in m, m/s and s. A first line of names may reorder
the columns. Text from a `#` to the end of the line is a comment; empty lines and empty optional cells are
skipped.

    x,    y,    z,    speed, dwell
    0.9,  0.0,  0.55              # straight ahead of the robot
    0.9,  0.3,  0.60, 0.1,   1.5

TOML: the same names.

    [[waypoints]]
    x = 0.9
    y = 0.0
    z = 0.55
    dwell = 1.5
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib import resources
from pathlib import Path
from typing import Annotated, Final

from msgspec import Meta, Struct

from zenoh_ice.data.toml_file import convert, read_text
from zenoh_ice.data.toml_file import parse_toml as parse

from ._axes import Point
from ._exceptions import WaypointException

Meters = Annotated[float, Meta(ge=-1000.0, le=1000.0, description="write m from -1000 to 1000")]
Speed = Annotated[float, Meta(gt=0.0, le=1000.0, description="write a speed above 0 m/s, at most 1000")]
Seconds = Annotated[float, Meta(ge=0.0, le=86400.0, description="write s from 0 to 86400")]


class Color(StrEnum):
    """The color of a ball, which identifies it and its built-in waypoints."""

    GREEN = "green"
    RED = "red"


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A point to carry the ball to."""

    point: Point
    speed: float | None = None
    """Speed in m/s on the line that leads here; None for the mover's."""
    dwell: float = 0.0
    """Time in s to stay."""
    source: str = "waypoint"
    """File and line, or number in the file, for messages."""

    def __str__(self) -> str:
        return f"{self.source}: waypoint {self.point}"


class _Entry(Struct, frozen=True, forbid_unknown_fields=True):
    """A waypoint as written in a file."""

    x: Meters
    y: Meters
    z: Meters
    speed: Speed | None = None
    dwell: Seconds = 0.0

    def at(self, source: str) -> Waypoint:
        return Waypoint(Point(self.x, self.y, self.z), self.speed, self.dwell, source)


class _File(Struct, frozen=True, forbid_unknown_fields=True):
    waypoints: Annotated[
        tuple[_Entry, ...], Meta(min_length=1, description="write one [[waypoints]] for each point")
    ]


_NAMES: Final = _Entry.__struct_fields__
_REQUIRED: Final = ("x", "y", "z")


def read_waypoints(path: Path) -> list[Waypoint]:
    """Read the waypoints of a file; one whose name ends in `.toml` is TOML, any other CSV.

    Raises WaypointException, naming file and line.
    """
    parse_text = parse_toml if path.suffix.lower() == ".toml" else parse_csv
    return parse_text(read_text(path, WaypointException), str(path))


def built_in_waypoints(color: Color) -> list[Waypoint]:
    """Return the waypoints that come with a ball."""
    name = f"{color}.csv"
    file = resources.files(__package__) / "paths" / name
    return parse_csv(file.read_text(encoding="utf-8"), name)


def parse_toml(text: str, name: str) -> list[Waypoint]:
    """Return the waypoints of a text in TOML; `name` is that of the file, for messages.

    Raises WaypointException.
    """
    entries = parse(text, _File, name, WaypointException).waypoints
    return [entry.at(f"{name}: waypoints[{number}]") for number, entry in enumerate(entries)]


def parse_csv(text: str, name: str) -> list[Waypoint]:
    """Return the waypoints of a text in CSV; `name` is that of the file, for messages.

    Raises WaypointException.
    """
    columns: Sequence[str] | None = None
    waypoints: list[Waypoint] = []
    for number, line in enumerate(text.split("\n"), start=1):
        cells = [cell.strip() for cell in line.partition("#")[0].split(",")]
        if not any(cells):
            continue
        source = f"{name}:{number}"
        if columns is None:
            if any(cell.lower() in _NAMES for cell in cells):
                columns = _check_columns(cells, source)
                continue
            columns = _NAMES
        while len(cells) > len(columns) and not cells[-1]:
            cells.pop()
        if len(cells) > len(columns):
            raise WaypointException(
                f"{source}: {len(cells)} values; at most {len(columns)} are expected: {', '.join(columns)}"
            )
        given = {
            column: _parse_number(cell, column, source)
            for column, cell in zip(columns, cells, strict=False)
            if cell
        }
        waypoints.append(convert(given, _Entry, source, WaypointException).at(source))
    if not waypoints:
        raise WaypointException(f"{name}: it has no waypoints")
    return waypoints


def _check_columns(cells: Sequence[str], source: str) -> list[str]:
    columns = [cell.lower() for cell in cells]
    while not columns[-1]:
        columns.pop()
    for column in columns:
        if column not in _NAMES:
            raise WaypointException(
                f"{source}: there is no column {column!r}; the columns are {', '.join(_NAMES)}"
            )
        if columns.count(column) > 1:
            raise WaypointException(f"{source}: column {column!r} appears twice")
    for column in _REQUIRED:
        if column not in columns:
            raise WaypointException(f"{source}: column {column!r} is missing")
    return columns


def _parse_number(cell: str, column: str, source: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise WaypointException(f"{source}: {column} must be a number, not {cell!r}") from None
