"""Describe what code does: the operations that it calls, the events that it sends, and how it answers."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import NamedTuple

from ._definitions import UNKNOWN, Answer
from ._possible_values import NOTHING, UNSURE, Values


class ProxyCall(NamedTuple):
    """The use of an operation of `self.<proxy>`."""

    proxy: str
    operation: str


@dataclass
class Effects:
    """The effects of a piece of code, and of the functions that it calls; some calls are only possible."""

    calls: set[ProxyCall] = field(default_factory=set)
    possible: set[ProxyCall] = field(default_factory=set)
    events: dict[str, set[ast.AST]] = field(default_factory=dict)
    """The events that it sends, with the expressions of their names or the calls of functions that send."""
    answer: Answer = Answer.SAME
    any_event: list[ast.AST] = field(default_factory=list)
    any_call: list[ast.AST] = field(default_factory=list)
    """Places that may send any event, and those that may call any operation of any proxy."""
    returned: Values = NOTHING
    """What a function returns."""

    def add(self, other: Effects, call: ast.AST | None = None) -> None:
        """Add the effects of other code that runs here; `call` replaces its places."""
        self.calls |= other.calls
        self.possible |= other.possible
        self.answer |= other.answer
        for event, places in other.events.items():
            self.events.setdefault(event, set()).update(places if call is None else {call})
        for mine, more in ((self.any_event, other.any_event), (self.any_call, other.any_call)):
            mine.extend(more if call is None else [call][: len(more)])


def anything(node: ast.AST) -> Effects:
    """Return the effects of code that may do anything."""
    return Effects(answer=UNKNOWN, any_event=[node], any_call=[node], returned=UNSURE)
