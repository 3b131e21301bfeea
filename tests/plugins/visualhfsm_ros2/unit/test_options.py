"""The options of ROS in the command of a component."""

from __future__ import annotations

from codegen.hfsm._checks.component import STANDARD_OPTIONS
from visualhfsm_ros2._options import options


def test_no_parameter_can_have_the_name_of_one() -> None:
    assert {each.name for each in options()} <= STANDARD_OPTIONS
