"""The graph of ROS, which a plug-in reads."""

from __future__ import annotations

import pytest

from tests.support.plugins import without
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.graphs import read_ros_graph
from zenoh_ice import Settings


def test_without_the_plug_in_the_page_learns_what_to_install() -> None:
    with (
        without("visualhfsm_ros2"),
        pytest.raises(VisualHfsmError, match=r"ROS is not installed.*pip install 'visualhfsm\[ros2\]'"),
    ):
        read_ros_graph(Settings())
