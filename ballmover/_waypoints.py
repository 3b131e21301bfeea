"""Files of waypoints: CSV or TOML, as `ballmover --help` describes them."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from importlib import resources
from pathlib import Path
from typing import Annotated, NamedTuple

from msgspec import Meta, Struct

from zenoh_ice.data.toml_file import convert, parse_toml, read_text

from ._exceptions import WaypointException

Meters = Annotated[float, Meta(ge=-1000.0, le=1000.0, description="write m from -1000 to 1000")]
Speed = Annotated[float, Meta(gt=0.0, le=1000.0, description="write a speed above 0 m/s, at most 1000")]
Seconds = Annotated[float, Meta(ge=0.0, le=86400.0, description="write s from 0 to 86400")]


class Color(StrEnum):
    """The color of a ball, which identifies it and its built-in waypoints."""

    GREEN = "green"
    RED = "red"


class Point(NamedTuple):
    """A point of the world in m: x forward, y left, z up from where the robot's feet are at the start."""

    x: float
    y: float
    z: float

    def __str__(self) -> str:
        return f"({self.x:.3g}, {self.y:.3g}, {self.z:.3g})"


class Waypoint(Struct, frozen=True, forbid_unknown_fields=True):
    """A point to carry the ball to, the speed on the way there (None: the mover's), and the time to stay."""

    x: Meters
    y: Meters
    z: Meters
    speed: Speed | None = None
    dwell: Seconds = 0.0

    @property
    def point(self) -> Point:
        """Return the point."""
        return Point(self.x, self.y, self.z)


class _File(Struct, frozen=True, forbid_unknown_fields=True):
    waypoints: Annotated[
        tuple[Waypoint, ...], Meta(min_length=1, description="write one [[waypoints]] for each point")
    ]


def read_waypoints(path: Path) -> Sequence[Waypoint]:
    """Read the waypoints of a file; one whose name ends in `.toml` is TOML, any other CSV.

    Raises WaypointException, naming file and line.
    """
    text = read_text(path, WaypointException)
    return (read_toml if path.suffix.lower() == ".toml" else read_csv)(text, str(path))


def built_in_waypoints(color: Color) -> Sequence[Waypoint]:
    """Return the waypoints that come with a ball."""
    file = resources.files(__package__) / "paths" / f"{color}.csv"
    return read_csv(file.read_text(encoding="utf-8"), file.name)


def read_toml(text: str, name: str) -> Sequence[Waypoint]:
    """Return the waypoints of a text in TOML from a file `name`. Raises WaypointException."""
    return parse_toml(text, _File, name, WaypointException).waypoints


def read_csv(text: str, name: str) -> Sequence[Waypoint]:
    """Return the waypoints of a text in CSV from a file `name`. Raises WaypointException."""
    columns: list[str] = []
    waypoints: list[Waypoint] = []
    for number, line in enumerate(text.split("\n"), start=1):
        cells = [cell.strip() for cell in line.partition("#")[0].rstrip(", \r").split(",")]
        if not any(cells):
            continue
        source = f"{name}:{number}"
        if not columns:
            names = [cell.lower() for cell in cells]
            columns = [*Waypoint.__struct_fields__]
            if not {*names}.isdisjoint(columns):
                if len({*names}) < len(names):
                    raise WaypointException(f"{source}: a column appears twice")
                convert(dict.fromkeys(names, 1.0), Waypoint, source, WaypointException)
                columns = names
                continue
        if len(cells) > len(columns):
            raise WaypointException(f"{source}: {len(cells)} values for the columns {', '.join(columns)}")
        given = {column: cell for column, cell in zip(columns, cells, strict=False) if cell}
        waypoints.append(convert(given, Waypoint, source, WaypointException, strict=False))
    if not waypoints:
        raise WaypointException(f"{name}: it has no waypoints")
    return waypoints
