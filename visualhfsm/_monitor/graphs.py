"""What a plug-in reads of the surroundings of a robot beside its realm: the graph of ROS."""

from __future__ import annotations

from typing import Any

from visualhfsm._base.errors import MissingPackageError, VisualHfsmError
from zenoh_ice import Settings, ZenohIceError
from zenoh_ice.plugins import KINDS, PluginError, find


def read_ros_graph(settings: Settings) -> dict[str, Any]:
    """Return the names in the graph of ROS with their types, as JSON, which takes about a second.

    The names are in `topics`, `services` and `actions`, and all known types in `types`, by their kinds.
    Raises VisualHfsmError.
    """
    failures = (ImportError, ZenohIceError, PluginError)
    with VisualHfsmError.in_place_of(failures, "the graph of ROS cannot be read: {reason}"):
        ros = find(KINDS, "ros", "graph")
        if ros is None:
            raise MissingPackageError("ROS", "ros2")
        graph: dict[str, Any] = ros.read_graph(settings)
        return graph
