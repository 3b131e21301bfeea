"""Two nodes of ours that the tests of a module share."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest

from plugins.ros2.tests.support.ros_nodes import two_nodes
from zenoh_ros2 import Node

_numbers = itertools.count(1)


@pytest.fixture(scope="module")
def nodes() -> Iterator[tuple[Node, Node]]:
    """A robot and a tool; a test gives what it makes of them a name of its own."""
    with two_nodes() as pair:
        yield pair


@pytest.fixture
def name() -> str:
    """A name of a topic, a service or an action that no other test uses."""
    return f"/n{next(_numbers)}"
