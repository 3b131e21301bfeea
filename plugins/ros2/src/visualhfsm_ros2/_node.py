"""The node of a component that runs on its robot."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any

import typer

from hfsm_runtime.component import Component, name_of
from hfsm_runtime.debugger.monitor import Monitor
from hfsm_runtime.errors import ComponentError
from zenoh_ice import Settings
from zenoh_ros2 import ActionClient, Node, QoS, RosError, settings_of_node

from ._ends import Endpoints
from ._monitor import RosMonitor
from .names import Ros


@contextmanager
def opened(component: type[Component], settings: Settings, options: Mapping[str, Any]) -> Iterator[_OpenNode]:
    """Open the node of a component in a `with` block. Raises ComponentError and typer.BadParameter."""
    names: dict[str, str] = {}
    for each in options["remap"] or []:
        former, _, names[former] = each.partition(":=")
        if not (former and names[former]):
            raise typer.BadParameter(
                f"--remap takes FROM:=TO, such as /cmd_vel:=/turtle1/cmd_vel, not {each!r}"
            )
    own = settings_of_node(settings, options["ros_connect"] or ())
    name = re.sub(r"\W", "_", name_of(component), flags=re.ASCII)
    namespace, domain = options["ros_namespace"], options["ros_domain"]
    try:
        node = Node(name, namespace=namespace, domain=domain, settings=own, remap=names)
    except RosError as error:
        raise ComponentError(f"the node of ROS cannot start: {error}") from error
    with node:
        yield _OpenNode(node)


def make_end(node: Node, declared: Ros, qos: QoS) -> Any:  # noqa: ANN401
    """Announce what a component declares. Raises RosError."""
    match declared.kind:
        case "publish":
            return node.create_publisher(declared.type, declared.target, qos)
        case "subscribe":
            return node.create_subscription(declared.type, declared.target, qos=qos)
        case "service":
            return node.create_client(declared.type, declared.target)
        case _:
            return ActionClient(node, declared.type, declared.target)


class _OpenNode(Endpoints):
    """The ends of a component, at its node."""

    def __init__(self, node: Node) -> None:
        super().__init__(partial(make_end, node), node.types)
        self._node = node

    def shown(self, monitor: Monitor) -> RosMonitor:
        """Show the component in the graph of ROS, in a `with` block."""
        return RosMonitor(monitor, self._node)
