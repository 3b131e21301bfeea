"""The recording as a script: what comes next, what of it has been used, and what was known when."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..recording.messages import Action, Cycle, EventSent, Gap, Message, Overlap, Reading, Result
from ..recording.recorder import automaton_context
from .reader import Record, Recording

__all__ = ["Script", "Want", "context_of"]

_FAR = 5000
"""Messages that are looked through for what belongs to a cycle."""
_INPUTS = (Action, Cycle, Gap, Overlap, Reading, Result)


@dataclass(frozen=True, slots=True)
class Want:
    """What code asks for: a reading of a kind, or, with an attribute, the outcome of an operation."""

    kind: str
    attribute: str = ""
    operation: str = ""

    def fits(self, record: Record) -> bool:
        """Return whether a record is what is asked for."""
        message = record.message
        if self.attribute:
            return (
                isinstance(message, Result)
                and message.kind == self.kind
                and message.operation == self.operation
                and attribute_of(record) == self.attribute
            )
        return isinstance(message, Reading) and message.kind == self.kind

    def __str__(self) -> str:
        if self.attribute:
            return f"self.{self.attribute}.{self.operation} ({self.kind})"
        return {"component": "the component's time"}.get(self.kind, self.kind)


class Script:
    """Walk through a recording. `passed` is called with each record as the walk leaves it behind."""

    def __init__(self, recording: Recording, end: int, passed: Callable[[Record], None]) -> None:
        self.recording = recording
        self.time = 0
        """The time in ns of the record that comes next."""
        self._end = end
        self._passed = passed
        self._index = 0
        self._used: set[int] = set()
        self._next: Record | None = None

    def peek(self) -> Record | None:
        """Return the next record that has not been used; None at the end."""
        while self._next is None and self._index < len(self.recording):
            if self._index in self._used:
                self._used.discard(self._index)
                self._index += 1
                continue
            record = self.recording[self._index]
            if record.time > self._end:
                self._index = len(self.recording)
                break
            self._next = record
            self.time = max(self.time, record.time)
        return self._next

    def peek_input(self) -> Record | None:
        """Return the next record that somebody has to act on; leave what only tells of automata behind."""
        while (record := self.peek()) is not None and not isinstance(record.message, _INPUTS):
            self.advance()
        return record

    def advance(self) -> None:
        """Leave the next record behind."""
        record = self.peek()
        if record is not None:
            self._next = None
            self._index += 1
            self._passed(record)

    def stop(self) -> None:
        """Let this be the end."""
        self._next = None
        self._end = -1
        self._index = len(self.recording)

    def find(self, context: str, want: Want) -> Record | None:
        """Return, and use, what is asked for from further on in the same cycle; None if it is not there."""
        for index in range(self._index, min(self._index + _FAR, len(self.recording))):
            if index in self._used:
                continue
            record = self.recording[index]
            if context_of(record.message) == context:
                if want.fits(record):
                    if index == self._index:
                        self.advance()
                    else:
                        self._used.add(index)
                        self._passed(record)
                    return record
                if isinstance(record.message, Cycle) and not record.message.begins:
                    return None
        return None

    def cycle_ahead(self, context: str) -> Cycle | None:
        """Return the beginning of the cycle that the next records belong to."""
        for index in range(self._index, min(self._index + _FAR, len(self.recording))):
            message = self.recording[index].message
            if isinstance(message, Cycle) and message.begins and context_of(message) == context:
                return message
        return None


def context_of(message: Message) -> str | None:
    """Return the context that a message belongs to."""
    if isinstance(message, Reading | Result | EventSent):
        return message.context
    if isinstance(message, Cycle):
        return automaton_context(message.automaton)
    return None


def attribute_of(record: Record) -> str:
    """Return the proxy's attribute of a `Result`."""
    return record.topic.split("/")[2] if record.topic.count("/") >= 3 else ""
