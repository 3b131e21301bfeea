"""Two ROS nodes of ours that meet on loopback."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

from tests.support.limits import EVENT_LIMIT
from tests.support.processes import free_endpoint
from zenoh_ice import Settings
from zenoh_ros2 import Graph, Node

DOMAIN = 73
"""A domain that nobody on the machine uses."""


@contextmanager
def two_nodes(**options: Any) -> Iterator[tuple[Node, Node]]:
    """Make a node that listens, with some options, and one that connects to it."""
    endpoint = free_endpoint()
    listening = Settings(listen=(endpoint,), connect=())
    connecting = Settings(connect=(endpoint,))
    with (
        Node("robot", settings=listening, domain=DOMAIN, **options) as robot,
        Node("tool", settings=connecting, domain=DOMAIN) as tool,
    ):
        assert tool.graph.wait(lambda: robot.full_name in tool.graph.nodes(), EVENT_LIMIT)
        assert robot.graph.wait(lambda: "/tool" in robot.graph.nodes(), EVENT_LIMIT)
        yield robot, tool


class Inbox:
    """A callback that keeps the messages that it is given."""

    def __init__(self) -> None:
        self.messages: list[Any] = []
        self._changed = threading.Condition()

    def __call__(self, message: Any) -> None:
        with self._changed:
            self.messages.append(message)
            self._changed.notify_all()

    def wait(self, count: int = 1) -> list[Any]:
        """Wait for some messages, and return all."""
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.messages) >= count, EVENT_LIMIT), self.messages
            return [*self.messages]


def matched(one: Node, other: Node, name: str) -> None:
    """Wait until both nodes know two ends of a topic."""
    for graph in (one.graph, other.graph):
        ends = partial(both_ends, graph, name)
        assert graph.wait(ends, EVENT_LIMIT)


def both_ends(graph: Graph, name: str) -> bool:
    """Return whether a topic has a publisher and a subscription."""
    return bool(graph.entities("MP", name) and graph.entities("MS", name))
