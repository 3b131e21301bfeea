"""The output of ballmover on a terminal and elsewhere."""

from __future__ import annotations

import io
import logging
import re

import pytest
from rich.console import Console

from ballmover._axes import AxisLimits, Point
from ballmover._progress import Progress
from ballmover._route import Route
from ballmover._waypoints import Color, Waypoint

LIMITS = AxisLimits(-3.1, 3.1, 0.3, 2.0, 0.05, 1.2, 2.0, 1.0)


@pytest.fixture
def route() -> Route:
    points = [Waypoint(Point(0.9, 0.0, 0.5)), Waypoint(Point(0.9, 0.3, 0.5), None, 1.5)]
    return Route.plan(points, LIMITS, speed=0.25, loop=True)


def show(route: Route, *, terminal: bool, errors_there_too: bool = False) -> tuple[str, str]:
    out, errors = io.StringIO(), io.StringIO()
    progress = Progress(
        Color.GREEN,
        route,
        Console(file=out, force_terminal=terminal, width=100, soft_wrap=True),
        Console(file=errors, force_terminal=errors_there_too, width=100, soft_wrap=True),
    )
    with progress:
        progress.departed(1, route.stops[1], 2)
        progress.moved(Point(0.9, 0.15, 0.5), 0.5)
        progress.lost("the server [ball] is offline")
        progress.returned()
        progress.arrived(route.stops[1], 0.0123)
    return out.getvalue(), errors.getvalue()


def test_the_log_has_it_where_there_is_no_terminal(route: Route, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    assert show(route, terminal=False) == ("green: 2 waypoints\n", "")
    assert [(record.levelname, record.message) for record in caplog.records] == [
        ("DEBUG", "green: lap 2, waypoint 2 of 2 (0.9, 0.3, 0.5) at 0.25 m/s"),
        ("WARNING", "green: lost the ball; waiting for its server: the server [ball] is offline"),
        ("WARNING", "green: the ball is back; continuing"),
        ("DEBUG", "green: arrived, 1.2 cm off, staying 1.5 s"),
    ]


def test_a_bar_on_a_terminal_that_goes_away(route: Route, caplog: pytest.LogCaptureFixture) -> None:
    out, errors = show(route, terminal=True)
    assert "waypoint 2 of 2" in out
    assert "━" in out
    assert "arrived" not in out
    assert out.rstrip().endswith("\x1b[2K")  # the line is erased
    assert not errors
    assert "lost the ball" in caplog.text


def test_what_is_printed_on_the_terminal_of_the_bar_stands_above_it(route: Route) -> None:
    out, errors = show(route, terminal=True, errors_there_too=True)
    assert not errors
    assert re.search(r"\x1b\[2K[^\n]*green: lost the ball", out)  # the bar is erased first
