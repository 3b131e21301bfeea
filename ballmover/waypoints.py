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

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final

from .axes import Point
from .color import Color
from .exceptions import WaypointException

__all__ = ["Waypoint", "built_in_waypoints", "parse_csv", "parse_toml", "read_waypoints"]

_NAMES: Final = ("x", "y", "z", "speed", "dwell")
_REQUIRED: Final = ("x", "y", "z")
_MAX_FILE_SIZE: Final = 1 << 20  # bytes
_HEADER_OF_WAYPOINT: Final = re.compile(r"\s*\[\[\s*waypoints\s*\]\]")


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A point to carry the ball to."""

    point: Point
    speed: float | None = None
    """Speed in m/s on the line that leads here; None for the mover's."""
    dwell: float = 0.0
    """Time in s to stay."""
    source: str = "waypoint"
    """File and line, for messages."""

    def __str__(self) -> str:
        return f"{self.source}: waypoint {self.point}"


def read_waypoints(path: Path) -> list[Waypoint]:
    """Read the waypoints of a file; one whose name ends in `.toml` is TOML, any other CSV.

    Raises WaypointException, naming file and line.
    """
    try:
        with path.open("rb") as file:
            content = file.read(_MAX_FILE_SIZE + 1)
        if len(content) > _MAX_FILE_SIZE:
            raise WaypointException(f"{path}: larger than {_MAX_FILE_SIZE} bytes; split it")
        text = content.decode("utf-8-sig")
    except OSError as error:
        raise WaypointException(f"{path}: cannot read the waypoints: {error.strerror}") from error
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise WaypointException(f"{path}:{line}: not UTF-8 text: {error.reason}") from error
    parse = parse_toml if path.suffix.lower() == ".toml" else parse_csv
    return parse(text, str(path))


def built_in_waypoints(color: Color) -> list[Waypoint]:
    """Return the waypoints that come with a ball."""
    name = f"{color}.csv"
    file = resources.files(__package__) / "paths" / name
    return parse_csv(file.read_text(encoding="utf-8"), name)


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
        waypoints.append(_make_waypoint(given, source))
    return _check_any(waypoints, name)


def parse_toml(text: str, name: str) -> list[Waypoint]:
    """Return the waypoints of a text in TOML; `name` is that of the file, for messages.

    Raises WaypointException.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line = re.search(r"at line (\d+)", str(error))
        where = f"{name}:{line[1]}" if line else f"{name}:{text.count(chr(10)) + 1}"
        raise WaypointException(f"{where}: not TOML: {error}") from error
    except RecursionError as error:
        raise WaypointException(f"{name}: nested too deeply") from error
    for key in document:
        if key != "waypoints":
            raise WaypointException(
                f"{name}: there is no key {key!r}; write one [[waypoints]] for each point"
            )
    entries = document.get("waypoints", [])
    if not isinstance(entries, list):
        raise WaypointException(f"{name}: waypoints must be a list; write one [[waypoints]] for each point")
    sources = _sources_of_entries(text, name, len(entries))
    return _check_any(
        [_make_toml_waypoint(entry, source) for entry, source in zip(entries, sources, strict=True)], name
    )


def _sources_of_entries(text: str, name: str, count: int) -> list[str]:
    """Return file and line of each entry; tomllib does not tell them."""
    lines = [n for n, line in enumerate(text.split("\n"), start=1) if _HEADER_OF_WAYPOINT.match(line)]
    if len(lines) != count:  # written as an inline array
        return [f"{name}: waypoint {index}" for index in range(1, count + 1)]
    return [f"{name}:{line}" for line in lines]


def _make_toml_waypoint(entry: object, source: str) -> Waypoint:
    if not isinstance(entry, dict):
        raise WaypointException(f"{source}: a waypoint is a table with the keys {', '.join(_NAMES)}")
    given: dict[str, float] = {}
    for key, value in entry.items():
        if key not in _NAMES:
            raise WaypointException(f"{source}: there is no key {key!r}; the keys are {', '.join(_NAMES)}")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise WaypointException(f"{source}: {key} must be a number, not {value!r}")
        try:
            given[key] = float(value)
        except OverflowError:
            raise WaypointException(f"{source}: {key} is too large a number") from None
    return _make_waypoint(given, source)


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


def _make_waypoint(given: Mapping[str, float], source: str) -> Waypoint:
    for name in _REQUIRED:
        if name not in given:
            raise WaypointException(f"{source}: {name} is missing; a waypoint needs x, y and z in m")
    for name, value in given.items():
        if not math.isfinite(value):
            raise WaypointException(f"{source}: {name} must be finite, not {value}")
    speed, dwell = given.get("speed"), given.get("dwell", 0.0)
    if speed is not None and speed <= 0:
        raise WaypointException(f"{source}: speed must be above 0 m/s, not {speed:g}")
    if dwell < 0:
        raise WaypointException(f"{source}: dwell must not be negative, but is {dwell:g} s")
    return Waypoint(Point(given["x"], given["y"], given["z"]), speed, dwell, source)


def _check_any(waypoints: list[Waypoint], name: str) -> list[Waypoint]:
    if not waypoints:
        raise WaypointException(f"{name}: there is no waypoint in it")
    return waypoints
