"""The speeds of /cmd_vel; how other nodes set them is in plugins/ros2/tests/integration/test_ros2_gateway.py."""

from __future__ import annotations

import pytest

from visualhfsm_ros2.gateway._commands import Speeds


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ((0.05, 0.0, 0.2), (0.05, 0.0, 0.2)),
        ((0.6, 0.8, 0.0), (0.06, 0.08, 0.0)),
        ((0.2, 0.0, 0.4), (0.1, 0.0, 0.2)),
        ((0.1, 0.0, -1.0), (0.05, 0.0, -0.5)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ],
)
def test_a_velocity_beyond_the_speeds_keeps_the_form_of_its_path(
    asked: tuple[float, float, float], expected: tuple[float, float, float]
) -> None:
    speeds = Speeds()
    speeds.linear, speeds.turning = 0.1, 0.5
    assert speeds.limited(*asked) == pytest.approx(expected)
