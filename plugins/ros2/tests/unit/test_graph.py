"""What the editor finds in the graph of ROS."""

from __future__ import annotations

import sys

import pytest

from plugins.ros2.tests.support.ros_nodes import DOMAIN
from tests.support.processes import free_endpoint
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.graphs import read_ros_graph
from zenoh_ice import Settings
from zenoh_ros2 import ActionServer, Node


@pytest.mark.slow
def test_names_and_types_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    endpoint = free_endpoint()
    with Node("robot", settings=Settings(listen=(endpoint,), connect=()), domain=DOMAIN) as robot:
        robot.create_publisher("sensor_msgs/msg/LaserScan", "/scan")
        robot.create_service("std_srvs/srv/Trigger", "/stop", lambda _request: {})
        ActionServer(robot, "example_interfaces/action/Fibonacci", "/count", lambda _goal: {})
        found = read_ros_graph(Settings(connect=(endpoint,)))
    assert found["topics"]["/scan"] == ["sensor_msgs/msg/LaserScan"]
    assert found["services"]["/stop"] == ["std_srvs/srv/Trigger"]
    assert found["actions"] == {"/count": ["example_interfaces/action/Fibonacci"]}
    assert "geometry_msgs/msg/Twist" in found["types"]["msg"]


@pytest.mark.slow
def test_bad_domains_and_missing_packages_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "kitchen")
    with pytest.raises(VisualHfsmError, match="kitchen"):
        read_ros_graph(Settings(connect=(free_endpoint(),)))
    monkeypatch.setitem(sys.modules, "zenoh_ros2", None)
    with pytest.raises(VisualHfsmError, match="the graph of ROS cannot be read"):
        read_ros_graph(Settings())
