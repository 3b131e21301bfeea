"""What plug-ins read of the surroundings of a robot beside its realm: the graph of ROS is the first."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from visualhfsm._base.errors import MissingPackageError, VisualHfsmError
from zenoh_ice import Settings, ZenohIceError, plugins

ReadGraph = Callable[[Settings], dict[str, Any]]
"""Return the names in a graph with their types, as JSON. Raises ZenohIceError, and ImportError for a package.

The names are in `topics`, `services` and `actions`, and all known types in `types`, by their kinds. It is an
entry point of `visualhfsm.graphs`.
"""


def read_ros_graph(settings: Settings) -> dict[str, Any]:
    """Return the graph of ROS, which takes about a second. Raises VisualHfsmError."""
    failures = (ImportError, ZenohIceError, plugins.PluginError)
    with VisualHfsmError.in_place_of(failures, "the graph of ROS cannot be read: {reason}"):
        read: ReadGraph | None = plugins.find("visualhfsm.graphs", "ros")
        if read is None:
            raise MissingPackageError("ROS", "ros2")
        return read(settings)
