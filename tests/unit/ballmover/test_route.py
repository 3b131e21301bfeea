"""The axes of a ball, and which routes they allow."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from ballmover._axes import AxisLimits, AxisPosition, Point
from ballmover._exceptions import UnreachableException
from ballmover._route import Approach, Line, Route
from ballmover._waypoints import Waypoint

LIMITS = AxisLimits(
    min_pan=-math.pi,
    max_pan=math.pi,
    min_distance=0.3,
    max_distance=2.0,
    min_height=0.05,
    max_height=1.2,
    max_pan_speed=2.0,
    max_linear_speed=1.0,
)

coordinate = st.floats(-3, 3)
points = st.builds(Point, coordinate, coordinate, coordinate)
fractions = st.floats(0, 1)
positions = st.builds(AxisPosition, st.floats(-math.pi, math.pi), st.floats(0.3, 2.0), st.floats(0.05, 1.2))


def waypoint(x: float, y: float, z: float, speed: float | None = None) -> Waypoint:
    return Waypoint(Point(x, y, z), speed, 0.0, f"f.csv:{x:g}")


def plan(*waypoints: Waypoint, speed: float = 0.25, loop: bool = False, limits: AxisLimits = LIMITS) -> Route:
    return Route.plan(waypoints, limits, speed=speed, loop=loop)


@pytest.mark.parametrize(
    ("point", "axes"),
    [
        (Point(1, 0, 0.5), (0, 1, 0.5)),
        (Point(0, 1, 0.5), (math.pi / 2, 1, 0.5)),
        (Point(0.5, -0.5, 0.3), (-math.pi / 4, math.sqrt(0.5), 0.3)),
    ],
)
def test_axes_of_known_points(point: Point, axes: tuple[float, float, float]) -> None:
    position = AxisPosition.from_point(point)
    assert (position.pan, position.distance, position.height) == pytest.approx(axes)


@given(points, st.floats(-20, 20))
def test_point_and_axes_are_inverse(point: Point, near_pan: float) -> None:
    position = AxisPosition.from_point(point, near_pan)
    assert position.point == pytest.approx(point, abs=1e-9)
    assert abs(position.pan - near_pan) <= math.pi + 1e-9


@given(positions, points, fractions)
def test_a_line_is_straight_and_its_pan_does_not_jump(
    start: AxisPosition, end: Point, fraction: float
) -> None:
    line = Line(start, end)
    assume(line.least_distance() > 1e-3)
    here = line.at(fraction)
    expected = [a + fraction * (b - a) for a, b in zip(start.point, end, strict=True)]
    assert here.point == pytest.approx(expected, abs=1e-9)
    assert abs(here.pan - start.pan) < math.pi
    assert here.distance >= line.least_distance() - 1e-9
    assert line.at(0.0).point == pytest.approx(start.point, abs=1e-9)


@given(positions, positions, fractions)
@example(AxisPosition(0.0, 1.0, 0.5), AxisPosition(1.0, 1.0, 0.5), 0.5)
def test_the_axes_keep_up_with_the_highest_speed_of_a_line(
    start: AxisPosition, end: AxisPosition, fraction: float
) -> None:
    line = Line(start, end.point)
    assume(line.least_distance() > 0.1)
    assume(start.point.distance_to(end.point) > 0.01)
    duration = line.duration(line.highest_speed(LIMITS))
    step = 1e-6
    fraction *= 1 - step
    a, b = line.at(fraction), line.at(fraction + step)
    seconds = step * duration
    assert abs(b.pan - a.pan) / seconds <= LIMITS.max_pan_speed * 1.001
    assert abs(b.distance - a.distance) / seconds <= LIMITS.max_linear_speed * 1.001
    assert abs(b.height - a.height) / seconds <= LIMITS.max_linear_speed * 1.001


@given(positions, positions, fractions, st.floats(0.01, 10))
def test_an_approach_stays_within_limits_and_speeds(
    start: AxisPosition, end: AxisPosition, fraction: float, speed: float
) -> None:
    approach = Approach(start, end, LIMITS)
    assert LIMITS.violation(approach.at(fraction)) is None
    assert approach.at(1.0).point == pytest.approx(end.point, abs=1e-9)
    duration = approach.duration(speed)
    assert start.point.distance_to(end.point) <= speed * duration * (1 + 1e-9)
    assert abs(end.pan - start.pan) <= LIMITS.max_pan_speed * duration * (1 + 1e-9)


@pytest.mark.parametrize(
    ("route", "message"),
    [
        (
            [(2.5, 0, 0.5)],
            "f.csv:2.5: waypoint (2.5, 0, 0.5) cannot be reached: its distance from the vertical",
        ),
        ([(1, 0, 0.5), (0.1, 0, 0.5)], "f.csv:0.1: waypoint (0.1, 0, 0.5) cannot be reached: its distance"),
        ([(1, 0, 1.5)], "height above the ground would be 1.5 m, outside 0.05 to 1.2 m"),
        (
            [(1, 0.5, 0.5), (-1, -0.5, 0.5)],
            "f.csv:-1: waypoint (-1, -0.5, 0.5) cannot be reached on a straight line from (1, 0.5, 0.5): on the way",
        ),
        ([(-1, 0.5, 0.5), (-1.2, -0.5, 0.5)], "the line passes behind the robot, where its pan would be"),
        (
            [(1, 0, 0.5), (1, 0.5, 0.5, 1.5)],
            "f.csv:1: waypoint (1, 0.5, 0.5) cannot be reached on a straight",
        ),
        ([(1, 0, 0.5), (1.0001, 0.5, 0.5, 1.5)], "at 1.5 m/s: the axes keep up only to 1 m/s"),
    ],
)
def test_what_cannot_be_reached_is_refused_with_line_and_reason(
    route: list[tuple[float, ...]], message: str
) -> None:
    with pytest.raises(UnreachableException) as raised:
        plan(*(waypoint(*numbers) for numbers in route))
    assert message in str(raised.value)


def test_a_pan_beyond_its_limit_is_refused() -> None:
    limits = AxisLimits(-1.0, 1.0, 0.3, 2.0, 0.05, 1.2, 2.0, 1.0)
    with pytest.raises(UnreachableException, match=r"its pan would be 1\.57 rad, outside -1 to 1 rad"):
        plan(waypoint(0, 1, 0.5), limits=limits)


SQUARE = [waypoint(1, 0, 0.5), waypoint(0, 1, 0.5), waypoint(-1, 0, 0.5), waypoint(0, -1, 0.5)]


def test_a_loop_round_the_axis_is_refused_where_the_pan_has_limits() -> None:
    wide = AxisLimits(-10.0, 10.0, 0.3, 2.0, 0.05, 1.2, 2.0, 1.0)
    assert [round(s.axes.pan, 3) for s in plan(*SQUARE, limits=wide).stops] == [0.0, 1.571, 3.142, 4.712]
    with pytest.raises(UnreachableException, match=r"each lap would turn the pan by 6\.28 rad"):
        plan(*SQUARE, loop=True, limits=wide)


def test_a_line_through_the_axis_is_refused_even_without_a_least_distance() -> None:
    limits = AxisLimits(-10.0, 10.0, 0.0, 2.0, 0.05, 1.2, 2.0, 1.0)
    with pytest.raises(UnreachableException, match="cross the vertical axis"):
        plan(waypoint(1, 0, 0.5), waypoint(-1, 0, 0.5), limits=limits)
