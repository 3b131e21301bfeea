"""Read the graph of ROS 2 for interfaces that a document could declare."""

from __future__ import annotations

from typing import Any, Final

from zenoh_ice import Settings, ZenohIceError

_SEARCH_TIME: Final = 1.0
"""Seconds in which nodes are found."""
_MOST_SHOWN: Final = 2000
"""Topics, services or actions that are shown at most."""


def read_graph(settings: Settings) -> dict[str, Any]:
    """Return the names in the graph with their types, and all known types.

    The names are in `topics`, `services` and `actions`, the known types in `types` by `msg`, `srv` and
    `action`. It takes about a second. Raises ZenohIceError, and ImportError without the packages of ROS.
    """
    import zenoh_ros2  # its dependencies are needed only with ROS

    try:
        with zenoh_ros2.Node("visualhfsm", settings=zenoh_ros2.settings_of_node(settings)) as node:
            graph = node.graph
            graph.wait(lambda: False, _SEARCH_TIME)
            found = {"topics": graph.topics(), "services": graph.services(), "actions": graph.actions()}
            types = {kind: node.types.names(kind) for kind in ("msg", "srv", "action")}
    except zenoh_ros2.RosError as error:
        raise ZenohIceError(str(error)) from error
    return {**{name: dict([*each.items()][:_MOST_SHOWN]) for name, each in found.items()}, "types": types}
