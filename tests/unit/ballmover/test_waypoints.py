"""Files of waypoints: valid ones, and the errors of invalid ones."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ballmover._exceptions import WaypointException
from ballmover._waypoints import Color, Waypoint, built_in_waypoints, read_csv, read_toml, read_waypoints
from tests.support.examples import examples

coordinates = st.floats(-100, 100)
waypoints = st.builds(
    Waypoint,
    coordinates,
    coordinates,
    coordinates,
    st.none() | st.floats(0.001, 10),
    st.floats(0, 100),
)


def test_csv_with_header_comments_and_empty_cells() -> None:
    text = "# a figure\nz, x, y, dwell, speed\n\n0.5, 0.9, -0.1,, 0.2  # fast\r\n 0.6 ,0.8,0,\n"
    assert read_csv(text, "f.csv") == [
        Waypoint(0.9, -0.1, 0.5, 0.2, 0.0),
        Waypoint(0.8, 0.0, 0.6, None, 0.0),
    ]


def test_csv_without_header() -> None:
    assert [*read_csv("0.9,0,0.5\n0.9,0.1,0.5,0.3,2", "f")] == [
        Waypoint(0.9, 0.0, 0.5),
        Waypoint(0.9, 0.1, 0.5, 0.3, 2.0),
    ]


def test_toml() -> None:
    text = "[[waypoints]]\nx = 1\ny = 0.5\nz = 0.25\n\n[[waypoints]]\nx = 1\ny = 0\nz = 0.25\nspeed = 0.1\ndwell = 1\n"
    assert [*read_toml(text, "f.toml")] == [
        Waypoint(1.0, 0.5, 0.25),
        Waypoint(1.0, 0.0, 0.25, 0.1, 1.0),
    ]


@settings(max_examples=examples(40))
@given(st.lists(waypoints, min_size=1, max_size=20))
def test_csv_gives_back_what_was_written(points: list[Waypoint]) -> None:
    lines = [
        f"{p.x!r}, {p.y!r}, {p.z!r}, {'' if p.speed is None else repr(p.speed)}, {p.dwell!r}" for p in points
    ]
    assert [*read_csv("\n".join(lines), "f")] == points


@settings(max_examples=examples(40))
@given(st.lists(waypoints, min_size=1, max_size=20))
def test_toml_gives_back_what_was_written(points: list[Waypoint]) -> None:
    tables = [
        f"[[waypoints]]\nx={p.x!r}\ny={p.y!r}\nz={p.z!r}\ndwell={p.dwell!r}\n"
        + ("" if p.speed is None else f"speed={p.speed!r}\n")
        for p in points
    ]
    assert [*read_toml("".join(tables), "f")] == points


@given(st.text(alphabet="xyzspedwl0123456789.,-#e \n\r;naif[]=\"'", max_size=80))
def test_any_text_is_read_or_refused_by_our_exception(text: str) -> None:
    refused = []
    for parse in (read_csv, read_toml):
        try:
            points = parse(text, "f")
        except WaypointException as error:
            refused.append(str(error))
            continue
        assert points
        assert all(math.isfinite(value) for p in points for value in (*p.point, p.dwell))
    assert all(message.startswith("f:") for message in refused)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0.9,0,0.5\n0.9,zero,0.5", "f:2: y = 'zero': write m from -1000 to 1000"),
        ("0.9,0", "f:1: z is missing"),
        ("0.9,,0.5", "f:1: y is missing"),
        ("0.9,0,0.5,0.1,0,7", "f:1: 6 values for the columns x, y, z, speed, dwell"),
        ("0.9,0,nan", "f:1: z = 'nan': write m from -1000 to 1000"),
        ("0.9,0,1e999", "f:1: z = '1e999': write m from -1000 to 1000"),
        ("0.9,0,0.5,0", "f:1: speed = '0': write a speed above 0 m/s"),
        ("0.9,0,0.5,,-1", "f:1: dwell = '-1': write s from 0"),
        ("x,y,hight\n1,2,3", "f:1: hight: there is no such key; there is x, y, z, speed, dwell"),
        ("x,y,y,z\n1,2,3,4", "f:1: a column appears twice"),
        ("x,y\n1,2", "f:1: z is missing"),
        ("x,,y,z\n1,,2,3", "f:1: there is no such key; there is x, y, z, speed, dwell"),
        ("", "f: it has no waypoints"),
        ("x,y,z\n# nothing\n", "f: it has no waypoints"),
    ],
)
def test_bad_csv_is_refused_with_line_and_reason(text: str, message: str) -> None:
    with pytest.raises(WaypointException) as raised:
        read_csv(text, "f")
    assert str(raised.value).startswith(message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[waypoints]]\nx = 1\ny = \nz = 2", "f: not TOML: Invalid value (at line 3"),
        ("[[waypoints]]\nx = 1\n\n[[waypoints]]\nx = 1\ny = 1", "f:1: waypoints[0]: y is missing"),
        (
            "[[waypoints]]\nx=1\ny=1\nz=1\n\n[[waypoints]]\nx=1\ny=1\nz='a'",
            "f:9: waypoints[1].z = 'a': write m from -1000 to 1000",
        ),
        ("[[waypoints]]\nx=1\ny=1\nz=true", "f:4: waypoints[0].z = true: write m from -1000 to 1000"),
        (
            "[[waypoints]]\nx=1\ny=1\nz=1\nw=1",
            "f:5: waypoints[0].w: there is no such key; there is x, y, z, speed, dwell",
        ),
        (f"[[waypoints]]\nx=1\ny=1\nz=1{'0' * 400}", "f:4: waypoints[0].z = 1000"),
        ("waypoints = [{x=1,y=1,z=1}, {x=1,y=1}]", "f:1: waypoints[1]: z is missing"),
        ("waypoints = [3]", "f:1: waypoints[0] = 3: write a table"),
        ("waypoints = 3", "f:1: waypoints = 3: write one [[waypoints]] for each point"),
        ("points = 3", "f:1: points: there is no such key; there is waypoints"),
        ("x = " + "[" * 100_000, "f: not TOML: nested too deeply"),
        ("", "f: waypoints is missing"),
        ("waypoints = []", "f:1: waypoints = []: write one [[waypoints]] for each point"),
    ],
)
def test_bad_toml_is_refused_with_line_and_reason(text: str, message: str) -> None:
    with pytest.raises(WaypointException) as raised:
        read_toml(text, "f")
    assert str(raised.value).startswith(message)


def test_a_file_is_read_by_its_ending(tmp_path: Path) -> None:
    csv, toml = tmp_path / "a.csv", tmp_path / "a.TOML"
    csv.write_text("\ufeffx,y,z\n1,2,3\n", encoding="utf-8")
    toml.write_text("[[waypoints]]\nx=1\ny=2\nz=3\n")
    assert [*read_waypoints(csv)] == [*read_waypoints(toml)] == [Waypoint(1.0, 2.0, 3.0)]


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(WaypointException, match="cannot be read: No such file"):
        read_waypoints(tmp_path / "none.csv")
    with pytest.raises(WaypointException, match="Is a directory"):
        read_waypoints(tmp_path)
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"1,2,3\n\xff\xfe")
    with pytest.raises(WaypointException, match=r"binary\.csv:2: not UTF-8"):
        read_waypoints(binary)
    big = tmp_path / "big.csv"
    big.write_bytes(b"#" * (2 << 20))
    with pytest.raises(WaypointException, match="larger than 1048576 bytes"):
        read_waypoints(big)


EYE_HEIGHT = 0.49  # m, of the top camera in StandInit


@pytest.mark.parametrize("color", list(Color))
def test_built_in_waypoints_are_before_the_robot(color: Color) -> None:
    for waypoint in built_in_waypoints(color):
        point = waypoint.point
        assert 0.7 <= math.hypot(point.x, point.y) <= 1.2
        assert abs(math.atan2(point.y, point.x)) <= math.radians(60)
        assert 0.3 <= point.z <= 0.75
        assert waypoint.speed is None, "--speed has a say only where a waypoint has none"


def test_the_built_in_red_ball_never_hides_the_green_one() -> None:
    green, red = built_in_waypoints(Color.GREEN), built_in_waypoints(Color.RED)
    assert min(p.z for p in green) > EYE_HEIGHT + 0.05
    assert max(p.z for p in red) < EYE_HEIGHT - 0.05
