"""Describe what code does: the operations that it calls, the events that it sends, and how it answers."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import NamedTuple

from ._definitions import UNKNOWN, Answer


class ProxyCall(NamedTuple):
    """The use of an operation of `self.<proxy>`."""

    proxy: str
    operation: str


@dataclass
class Effects:
    """The effects of a piece of code, with those of the functions that it calls.

    A call is `possible` if an expression may be one of several operations.
    """

    calls: set[ProxyCall] = field(default_factory=set)
    possible: set[ProxyCall] = field(default_factory=set)
    events: dict[str, set[ast.AST]] = field(default_factory=dict)
    """The events that it sends, with the expressions of their names or the calls of functions that send."""
    answer: Answer = Answer.SAME
    reads_component: bool = False
    """Whether it reads an attribute of the component, which who has the component may assign."""
    any_event: list[ast.AST] = field(default_factory=list)
    """Places that may send any event."""
    any_call: list[ast.AST] = field(default_factory=list)
    """Places that may call any operation of any proxy."""
    unknown: list[ast.AST] = field(default_factory=list)
    """Calls of unknown objects."""

    def add(self, other: Effects, call: ast.AST | None = None) -> None:
        """Add the effects of other code that runs here; `call` replaces its places."""
        self.calls |= other.calls
        self.possible |= other.possible
        self.add_events(other, call)
        self.answer |= other.answer
        self.reads_component |= other.reads_component
        for mine, more in (
            (self.any_event, other.any_event),
            (self.any_call, other.any_call),
            (self.unknown, other.unknown),
        ):
            mine.extend(more if call is None else [call][: len(more)])

    def add_events(self, other: Effects, call: ast.AST | None = None) -> None:
        """Add only the events of other code."""
        for event, places in other.events.items():
            self.events.setdefault(event, set()).update(places if call is None else {call})

    def allow_anything(self, node: ast.AST) -> None:
        """Record that a node may use the component in any way."""
        self.any_event.append(node)
        self.any_call.append(node)


def anything(node: ast.AST) -> Effects:
    """Return the effects of code that may do anything."""
    effects = Effects(answer=UNKNOWN)
    effects.allow_anything(node)
    return effects
