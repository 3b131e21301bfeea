"""Search graphs, which are functions that return the nodes after a node."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, KeysView
from typing import TypeVar

_Node = TypeVar("_Node", bound=Hashable)


def reached(starts: Iterable[_Node], following: Callable[[_Node], Iterable[_Node]]) -> KeysView[_Node]:
    """Return some nodes and all to which they lead, each once, the nearest first."""
    found = dict.fromkeys(starts)
    waiting = [*found]
    for node in waiting:  # grows
        new = [each for each in dict.fromkeys(following(node)) if each not in found]
        found.update(dict.fromkeys(new))
        waiting += new
    return found.keys()
