"""Read the graph of ROS 2 for interfaces that a document could declare."""

from __future__ import annotations

from typing import Any, Final

from visualhfsm._base.errors import VisualHfsmError
from zenoh_ice import Settings, ZenohIceError

_SEARCH_TIME: Final = 1.0
"""Seconds in which nodes are found."""
_MOST_SHOWN: Final = 2000
"""Topics, services or actions that are shown at most."""


def read_ros_graph(settings: Settings) -> dict[str, Any]:
    """Return the names in the graph with their types, and all known types.

    The names are in `topics`, `services` and `actions`, the known types in `types` by `msg`, `srv` and
    `action`. It takes about a second. Raises VisualHfsmError.
    """
    with VisualHfsmError.in_place_of(ImportError, "the graph of ROS cannot be read: {reason}"):
        import zenoh_ros2  # its dependencies are needed only with ROS
    with (
        VisualHfsmError.in_place_of(
            (zenoh_ros2.RosError, ZenohIceError), "the graph of ROS cannot be read: {reason}"
        ),
        zenoh_ros2.Node("visualhfsm", settings=zenoh_ros2.settings_of_node(settings)) as node,
    ):
        node.graph.wait(lambda: False, _SEARCH_TIME)
        found = {
            "topics": node.graph.topics(),
            "services": node.graph.services(),
            "actions": node.graph.actions(),
        }
        types = {kind: node.types.names(kind) for kind in ("msg", "srv", "action")}
    return {**{name: dict([*each.items()][:_MOST_SHOWN]) for name, each in found.items()}, "types": types}
